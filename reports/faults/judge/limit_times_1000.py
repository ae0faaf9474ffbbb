"""Planted fault: every limit multiplied by 1000."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rayproof.cases.rounding import gamma
from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import altered
from rayproof.reports.judge import limits


@FAULTS.register("judge/limit_times_1000", where="judge", stage=None)
@contextmanager
def limit_times_1000() -> Iterator[None]:
    """Scale the unit roundoff by 1000."""

    def wrong(roundoff: Any, count: float) -> float:
        return 1000 * roundoff.scale * gamma(count, precision=roundoff.precision)

    with altered(limits.Roundoff, "__call__", wrong):
        yield
