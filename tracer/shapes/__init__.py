"""The tracer's representation of shapes: arrays, transforms, bounds of errors."""
