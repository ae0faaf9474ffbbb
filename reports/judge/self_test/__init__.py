"""Answers whose verdict is known beforehand: the judge is tried on them before its word on any case counts."""
