"""Planted fault: the mean of an image's errors in place of the largest."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced
from rayproof.reports.judge import measurement


@FAULTS.register("judge/mean_for_maximum", where="judge", stage=None)
@contextmanager
def mean_for_maximum() -> Iterator[None]:
    """Spread the errors evenly over the image."""
    right = measurement.ratios

    def wrong(stage: Any, ours: Any, theirs: Any, limit: Any) -> Any:
        ratio, error = right(stage, ours, theirs, limit)
        finite = ratio[np.isfinite(ratio)]
        return np.full_like(ratio, finite.mean() if finite.size else np.inf), error

    with replaced(right, wrong):
        yield
