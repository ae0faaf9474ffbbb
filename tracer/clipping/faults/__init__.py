"""Planted faults of the clipping formulas, for `rayproof audit`; never in use unless named."""
