"""Planted fault: NaN compared with `>`, which is never true."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np

from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced
from rayproof.reports.judge import measurement


@FAULTS.register("judge/nan_passes", where="judge", stage=None)
@contextmanager
def nan_passes() -> Iterator[None]:
    """Let a NaN ratio count as no error, and count no NaN."""
    right, counted = measurement.ratios, measurement.measure

    def ratios(stage: Any, ours: Any, theirs: Any, limit: Any) -> Any:
        ratio, wrong = right(stage, ours, theirs, limit)
        return np.where(np.isnan(ours).any(axis=-1), 0.0, ratio), wrong

    def measure(*arguments: Any, **options: Any) -> Any:
        return replace(counted(*arguments, **options), nan=0)

    with replaced(right, ratios), replaced(counted, measure):
        yield
