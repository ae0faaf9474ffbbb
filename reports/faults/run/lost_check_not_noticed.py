"""Planted fault: a ledger adds up whatever was planned."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced
from rayproof.reports.judge import outcomes


@FAULTS.register("run/lost_check_not_noticed", where="run", stage=None)
@contextmanager
def lost_check_not_noticed() -> Iterator[None]:
    """Plan as many as were found."""
    right = outcomes.ledger

    def wrong(found: Any, *, planned: int) -> dict[str, int]:
        found = list(found)
        return right(found, planned=len(found))

    with replaced(right, wrong):
        yield
