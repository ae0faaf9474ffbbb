"""Planted fault: a coarse output's step is allowed twice."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import altered
from rayproof.reports.judge.resolving import Coarseness


@FAULTS.register("judge/resolution_twice", where="judge", stage=None)
@contextmanager
def resolution_twice() -> Iterator[None]:
    """Double every step."""
    right = Coarseness.step

    def wrong(self: Any, stage: Any, value: Any) -> Any:
        return 2 * right(self, stage, value)

    with altered(Coarseness, "step", wrong):
        yield
