"""Planted fault: a case with too few pixels to judge passes."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced
from rayproof.reports.judge import sufficiency


@FAULTS.register("judge/interior_not_demanded", where="judge", stage=None)
@contextmanager
def interior_not_demanded() -> Iterator[None]:
    """Ask for no interior pixels."""
    right = sufficiency.too_little

    def wrong(*arguments: Any) -> list[str]:
        return []

    with replaced(right, wrong):
        yield
