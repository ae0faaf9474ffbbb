"""The tracer's own acceleration structure: a numpy builder, and bundles of rays on their way through it on Dr.Jit."""
