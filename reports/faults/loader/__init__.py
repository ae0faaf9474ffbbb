"""Planted faults of the mesh loader."""
