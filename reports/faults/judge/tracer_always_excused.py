"""Planted fault: whatever differs, the reference is suspected."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from reports.faults import FAULTS
from reports.faults.patching import replaced
from reports.judge import adjudicate
from reports.judge.outcomes import Outcome


@FAULTS.register("judge/tracer_always_excused", where="judge", stage=None)
@contextmanager
def tracer_always_excused() -> Iterator[None]:
    """Suspect the reference of every failure."""
    right = adjudicate.adjudicate

    def wrong(checks: Any, *rest: Any) -> None:
        right(checks, *rest)
        for check in checks:
            if check.outcome is Outcome.FAIL:
                check.outcome = Outcome.REFERENCE_SUSPECT

    with replaced(right, wrong):
        yield
