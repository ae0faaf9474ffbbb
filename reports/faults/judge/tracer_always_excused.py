"""Planted fault: whatever differs, the reference is suspected."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced
from rayproof.reports.judge import adjudicate
from rayproof.reports.judge.outcomes import Outcome


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
