"""Planted faults of the shading formulas, for `rayproof audit`; never in use unless named."""
