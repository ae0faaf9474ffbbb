"""Planted fault: the values of an edge's sides are taken three pixels away."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced
from rayproof.reports.judge import sides


class _Elsewhere:
    """An oracle that answers three pixels to the right of where it is asked."""

    def __init__(self, oracle: Any) -> None:
        self._oracle, self.continue_from = oracle, oracle.continue_from

    def at(self, scene: Any, stages: Any, points: Any) -> Any:
        return self._oracle.at(scene, stages, np.add(points, (3.0, 0.0)))


@FAULTS.register("judge/sides_elsewhere", where="judge", stage=None)
@contextmanager
def sides_elsewhere() -> Iterator[None]:
    """Ask the oracle three pixels to the right of every edge."""
    right = sides.sides

    def wrong(oracle: Any, *rest: Any) -> Any:
        return right(_Elsewhere(oracle), *rest)

    with replaced(right, wrong):
        yield
