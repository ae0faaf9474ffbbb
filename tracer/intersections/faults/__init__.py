"""Planted faults of the intersection formulas, for `rayproof audit`; never in use unless named."""
