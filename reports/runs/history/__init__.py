"""History: what runs found, kept in one SQLite file; steps in error and time over commits; what became worse.

`database` keeps runs, `revisions` says which commit ran, `steps` finds changes, `standing` compares the last run with
those before it.
"""
