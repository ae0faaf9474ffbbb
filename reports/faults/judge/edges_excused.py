"""Planted fault: an edge pixel may have any value, not only a side's."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced
from rayproof.reports.judge import sides


@FAULTS.register("judge/edges_excused", where="judge", stage=None)
@contextmanager
def edges_excused() -> Iterator[None]:
    """Excuse every edge pixel."""
    right = sides.excused

    def wrong(stage: Any, ours: Any, around: Any, limit: Any, shape: Any, **options: Any) -> Any:
        return np.ones(shape, dtype=bool)

    with replaced(right, wrong):
        yield
