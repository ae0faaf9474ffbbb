"""Planted faults: red, green, or the visibility of every light but the first is not compared."""

from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import Any

import numpy as np

from rayproof.cases.stages import Stage
from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced
from rayproof.reports.judge import measurement

LIGHT = (Stage.IRRADIANCE, Stage.EXITANCE, Stage.RADIANCE)


@contextmanager
def _not_compared(stages: tuple[Stage, ...], channels: slice) -> Iterator[None]:
    """Copy the reference's `channels` at some stages."""
    right = measurement.ratios

    def wrong(stage: Stage, ours: Any, theirs: Any, limit: Any) -> Any:
        if stage in stages and ours.shape == theirs.shape:
            ours = np.array(ours)
            ours[..., channels] = theirs[..., channels]
        return right(stage, ours, theirs, limit)

    with replaced(right, wrong):
        yield


@FAULTS.register("judge/red_ignored", where="judge", stage=None)
def red_ignored() -> AbstractContextManager[None]:
    """Leave red out."""
    return _not_compared(LIGHT, slice(0, 1))


@FAULTS.register("judge/green_ignored", where="judge", stage=None)
def green_ignored() -> AbstractContextManager[None]:
    """Leave green out."""
    return _not_compared(LIGHT, slice(1, 2))


@FAULTS.register("judge/first_light_only", where="judge", stage=None)
def first_light_only() -> AbstractContextManager[None]:
    """Compare the visibility of the first light alone."""
    return _not_compared((Stage.VISIBILITY,), slice(1, None))
