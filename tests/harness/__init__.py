"""What tests rayproof itself: planted faults, disturbed runs, broken files, verdicts on random scenes, paths."""
