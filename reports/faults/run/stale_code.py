"""Planted fault: a cached result of other code is taken up again."""

from collections.abc import Iterator
from contextlib import contextmanager

from reports.faults import FAULTS
from reports.faults.patching import replaced
from reports.run import plan


@FAULTS.register("run/stale_code", where="run", stage=None)
@contextmanager
def stale_code() -> Iterator[None]:
    """Leave the code out of the key."""
    right = plan.code_digest

    def wrong() -> str:
        return ""

    with replaced(right, wrong):
        yield
