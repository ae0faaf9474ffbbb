"""Arithmetic that several formulas share: matrices, products, quadratics, units in the last place, float64."""
