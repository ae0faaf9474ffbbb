"""Relative mean square error: each pixel's squared error over its squared reference.

Source: Rousselle, Knaus and Zwicker, "Adaptive sampling and reconstruction using greedy error minimization", ACM
Transactions on Graphics 30(6), 2011; with their 0.01 against division by zero, in units of the image's range.
"""

import numpy as np

from rayproof.reports.judge.comparison.metrics import METRICS

SOFTENING = 0.01


@METRICS.register("relative_mse")
def relative_mean_square(ours: np.ndarray, theirs: np.ndarray, value_range: tuple[float, float]) -> float | None:
    """Return the mean of (ours - theirs)^2 / (theirs^2 + softening); None without contrast."""
    low, high = value_range
    scale = max(abs(low), abs(high))
    if not scale > 0:
        return None
    return float(np.mean((ours - theirs) ** 2 / (theirs**2 + SOFTENING * scale**2)))
