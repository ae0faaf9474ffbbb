"""Shapes as the tracer holds them: records, transforms, triangles and bounds."""
