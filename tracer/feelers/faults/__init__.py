"""Planted faults of the feeler formulas, for `rayproof audit`; never in use unless named."""
