"""Planted faults: a kept record is taken up again whatever changed, or whatever code it was found by."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced
from rayproof.reports.run import plan
from rayproof.reports.run.guards.keys import CASE


@FAULTS.register("run/stale_result", where="run", stage=None)
@contextmanager
def stale_result() -> Iterator[None]:
    """Give every case the same key."""
    right = plan.record_key

    def wrong(planned: Any, demands: Any) -> Any:
        return right(replace(planned, case=CASE), demands)

    with replaced(right, wrong):
        yield


@FAULTS.register("run/stale_code", where="run", stage=None)
@contextmanager
def stale_code() -> Iterator[None]:
    """Leave the code out of the key."""
    right = plan.record_key

    def wrong(planned: Any, demands: Any) -> Any:
        return replace(right(planned, demands), code="")

    with replaced(right, wrong):
        yield
