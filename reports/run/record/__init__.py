"""The record of a run and of its cases: what is counted, kept and written once everything is judged."""
