"""Planted fault: a coarse output is judged as if it were not."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import altered
from rayproof.reports.judge.resolving import Coarseness


@FAULTS.register("judge/resolution_ignored", where="judge", stage=None)
@contextmanager
def resolution_ignored() -> Iterator[None]:
    """Give every step as 0."""

    def wrong(self: Any, stage: Any, value: Any) -> float:
        return 0.0

    with altered(Coarseness, "step", wrong):
        yield
