"""Planted fault: a case takes the best verdict of its checks."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced
from rayproof.reports.judge import outcomes


@FAULTS.register("run/best_for_worst", where="run", stage=None)
@contextmanager
def best_for_worst() -> Iterator[None]:
    """Take the best outcome for the worst."""
    right = outcomes.worst

    def wrong(found: Any) -> Any:
        return min(found, key=list(outcomes.Outcome).index, default=outcomes.Outcome.MISSING)

    with replaced(right, wrong):
        yield
