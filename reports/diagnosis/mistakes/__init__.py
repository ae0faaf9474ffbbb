"""The known mistakes, by what they concern: one entry each, found by listing this folder."""
