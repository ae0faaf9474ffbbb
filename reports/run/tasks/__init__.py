"""The tasks that a run's workers carry out: ask a reference, trace, judge."""
