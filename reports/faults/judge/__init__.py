"""Planted faults of the judge."""
