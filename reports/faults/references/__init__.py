"""Planted faults of the references."""
