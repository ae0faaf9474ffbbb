"""Studies beyond a run's verdict: stability, comparison of formulas, error against time, speed and scaling."""
