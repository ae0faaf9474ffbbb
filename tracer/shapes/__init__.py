"""Shapes as the tracer holds them: arrays, transforms, bounds of errors."""
