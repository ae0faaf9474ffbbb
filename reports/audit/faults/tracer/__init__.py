"""Planted faults that live in one execution path of the tracer alone (`tracer.paths`)."""
