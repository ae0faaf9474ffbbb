"""Planted faults of the runner and its ledgers."""
