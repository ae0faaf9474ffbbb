"""How small the smallest failing scenes are, over planted faults of the tracer and the switches of the C++ example."""
