"""Judging one case: limits, pixel classes, checks, the panel, verdicts. Only `pass` is a pass."""
