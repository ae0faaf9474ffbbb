"""The tracer's own acceleration structure for triangles: a numpy builder and a traversal on Dr.Jit."""
