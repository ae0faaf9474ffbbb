"""Planted fault: a case in which nothing was measured passes."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced
from rayproof.reports.judge import outcomes
from rayproof.reports.judge.outcomes import Outcome


@FAULTS.register("run/unmeasured_passes", where="run", stage=None)
@contextmanager
def unmeasured_passes() -> Iterator[None]:
    """Call the worst of nothing a pass."""
    right = outcomes.worst

    def wrong(found: Any) -> Outcome:
        found = list(found)
        return right(found) if found else Outcome.PASS

    with replaced(right, wrong):
        yield
