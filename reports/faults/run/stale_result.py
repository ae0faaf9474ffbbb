"""Planted fault: a cached result is taken up again whatever changed."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from reports.faults import FAULTS
from reports.faults.patching import replaced
from reports.run import plan


@FAULTS.register("run/stale_result", where="run", stage=None)
@contextmanager
def stale_result() -> Iterator[None]:
    """Give every case of a name the same key."""
    right = plan.key

    def wrong(planned: Any, references: Any) -> str:
        return planned.case.name

    with replaced(right, wrong):
        yield
