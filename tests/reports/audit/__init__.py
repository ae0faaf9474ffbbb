"""Tests of the audit: that faults are planted, seen, blamed on the right stage and side, and taken out again."""
