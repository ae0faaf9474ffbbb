"""Planted fault: only a value above the reference's counts as an error."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced
from rayproof.reports.judge import measurement


@FAULTS.register("judge/one_sided_error", where="judge", stage=None)
@contextmanager
def one_sided_error() -> Iterator[None]:
    """Count no error where the value is below the reference's."""
    right = measurement.error

    def wrong(stage: Any, ours: Any, theirs: Any) -> Any:
        found = right(stage, ours, theirs)
        below = (ours <= theirs) if found.ndim == ours.ndim else np.all(ours <= theirs, axis=-1)
        return np.where(below, 0.0, found)

    with replaced(right, wrong):
        yield
