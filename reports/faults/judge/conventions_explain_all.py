"""Planted fault: whatever stands alone is explained by some convention, untested."""

from collections.abc import Iterator
from contextlib import contextmanager

from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import altered
from rayproof.reports.judge.conventions import Tested


@FAULTS.register("judge/conventions_explain_all", where="judge", stage=None)
@contextmanager
def conventions_explain_all() -> Iterator[None]:
    """Say of every convention that it explains."""
    with altered(Tested, "explains", property(lambda self: True)):
        yield
