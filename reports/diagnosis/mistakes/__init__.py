"""The known mistakes by subject, each with how such a renderer answers; found by listing this folder."""
