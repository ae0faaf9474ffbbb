"""Planted fault: an infinity where the reference is finite counts as no error."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np

from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced
from rayproof.reports.judge import measurement


@FAULTS.register("judge/infinity_passes", where="judge", stage=None)
@contextmanager
def infinity_passes() -> Iterator[None]:
    """Let an infinite value count as no error, and count no infinity."""
    right, counted = measurement.ratios, measurement.measure

    def ratios(stage: Any, ours: Any, theirs: Any, limit: Any) -> Any:
        ratio, wrong = right(stage, ours, theirs, limit)
        return np.where(np.isinf(ours).any(axis=-1), 0.0, ratio), wrong

    def measure(*arguments: Any, **options: Any) -> Any:
        return replace(counted(*arguments, **options), inf=0)

    with replaced(right, ratios), replaced(counted, measure):
        yield
