"""Judging: pixel classes, limits, stages in order, adjudication, verdicts. Only `pass` is a pass."""
