"""Metrics: one file each. They inform a reader; the limits decide.

To add one: a function `(ours, theirs, value_range) -> float | None` on float64 images of shape (height, width,
channels), finite everywhere, in a new file under `@METRICS.register("name")`. None says that it is undefined here.
"""

from collections.abc import Callable

import numpy as np

from rayproof.cases.registry import Registry

Metric = Callable[[np.ndarray, np.ndarray, tuple[float, float]], float | None]
METRICS: Registry[Metric] = Registry("metric", package="rayproof.reports.judge.comparison.metrics")
