"""The known mistakes, by subject; found by listing this folder."""
