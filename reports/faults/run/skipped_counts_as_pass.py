"""Planted fault: a skipped case is counted as passed."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced
from rayproof.reports.judge import outcomes
from rayproof.reports.judge.outcomes import Outcome


@FAULTS.register("run/skipped_counts_as_pass", where="run", stage=None)
@contextmanager
def skipped_counts_as_pass() -> Iterator[None]:
    """Count what has no outcome as passed."""
    right = outcomes.ledger

    def wrong(found: Any, *, planned: int) -> dict[str, int]:
        found = [Outcome.PASS if one is Outcome.MISSING else one for one in found]
        return right(found + [Outcome.PASS] * (planned - len(found)), planned=planned)

    with replaced(right, wrong):
        yield
