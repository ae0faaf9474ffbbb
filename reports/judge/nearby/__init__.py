"""Nearby problems: a pixel over its limit is right if the oracle answers it so for a problem within rounding."""
