"""Planted fault: a case in which nothing was measured passes."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from reports.faults import FAULTS
from reports.faults.patching import replaced
from reports.judge import outcomes
from reports.judge.outcomes import Outcome


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
