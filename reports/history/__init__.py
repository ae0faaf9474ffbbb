"""A run held against known failures (the gate), against an earlier run, and over time.

`expectations` is the gate's file and `gating` holds a finished run against it. An expectation is about single checks,
that is case x configuration x reference x stage, and says how each fails. A check that fails otherwise, or less, or no
longer, is red as well, so that the file stays true. `run_difference` and `image_difference` compare two runs;
`database` keeps runs in a SQLite file.
"""
