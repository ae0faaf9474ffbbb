"""The gate of a CI job: what is known to fail is written down, and a run ends red only for what is not.

`expectations.py` is the file, `gating.py` holds a finished run against it, `accepting.py` writes and shrinks it. An
expectation is about single checks, that is case x configuration x reference x stage, and says how each of them fails.
One that fails otherwise, or less, or no longer, is red as well: a file that nobody keeps true is worth nothing.
"""
