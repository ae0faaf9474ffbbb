"""Planted faults of the camera formulas, for `rayproof audit`; never in use unless named."""
