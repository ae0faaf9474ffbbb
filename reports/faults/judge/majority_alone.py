"""Planted fault: the majority is said to stand alone, and the one that does is its judge."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced
from rayproof.reports.judge import standing


@FAULTS.register("judge/majority_alone", where="judge", stage=None)
@contextmanager
def majority_alone() -> Iterator[None]:
    """Exchange the two."""
    right = standing.standing

    def wrong(matrix: Any, voice: Any) -> Any:
        found = right(matrix, voice)
        return replace(found, alone=found.majority, majority=found.alone) if found.alone else found

    with replaced(right, wrong):
        yield
