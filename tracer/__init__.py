"""The renderer under test: the specification's formulas on Dr.Jit alone."""
