"""Studies in addition to a run's verdict: stability on ladders, comparisons, error against time."""
