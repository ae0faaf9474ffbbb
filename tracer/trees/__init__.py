"""Acceleration: hierarchies of boxes built with numpy, bundles of rays on their way through them, unrolled shapes."""
