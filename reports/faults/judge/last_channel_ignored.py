"""Planted fault: only the first channel of an image is compared."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced
from rayproof.reports.judge import measurement


@FAULTS.register("judge/last_channel_ignored", where="judge", stage=None)
@contextmanager
def last_channel_ignored() -> Iterator[None]:
    """Copy the reference's other channels."""
    right = measurement.ratios

    def wrong(stage: Any, ours: Any, theirs: Any, limit: Any) -> Any:
        if ours.shape == theirs.shape:
            ours = np.concatenate([ours[..., :1], theirs[..., 1:]], axis=-1)
        return right(stage, ours, theirs, limit)

    with replaced(right, wrong):
        yield
