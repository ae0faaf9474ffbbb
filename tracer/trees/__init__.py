"""Acceleration: hierarchies of boxes, beams of rays on their way through them, and shapes unrolled into the kernel."""
