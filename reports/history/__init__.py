"""Comparisons of a run with known failures (the gate), with an earlier run, and with the history of runs.

`expectations` reads and writes the file of known failures, and `gating` compares a finished run with it. An expectation
describes the failures of single checks, each given by case, configuration, reference and stage. The gate is also red if
a check fails in another way, fails less or passes, so that the file stays up to date. `run_difference` and
`image_difference` compare two runs; `database` stores runs in a SQLite file.
"""
