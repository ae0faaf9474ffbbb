"""Planted faults of the normal formulas, for `rayproof audit`; never in use unless named."""
