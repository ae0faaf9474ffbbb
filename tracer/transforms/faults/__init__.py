"""Planted faults of the transforms formulas, for `rayproof audit`; never in use unless named."""
