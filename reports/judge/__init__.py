"""Judging one case: limits, nearby problems, checks, the panel, verdicts. Only `pass` is a pass."""
