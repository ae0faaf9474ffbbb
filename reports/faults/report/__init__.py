"""Planted faults of what a report shows."""
