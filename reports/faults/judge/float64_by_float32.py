"""Planted fault: float64 is judged by the limits of float32."""

from collections.abc import Iterator
from contextlib import contextmanager
from copy import copy
from typing import Any

from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced
from rayproof.reports.judge import terms
from rayproof.reports.judge.limits import Roundoff


@FAULTS.register("judge/float64_by_float32", where="judge", stage=None)
@contextmanager
def float64_by_float32() -> Iterator[None]:
    """Take every party's rounding for that of float32."""
    right = terms.roundoff

    def wrong(party: Any) -> Roundoff:
        rounding = copy(right(party))
        rounding.precision = "float32"
        return rounding

    with replaced(right, wrong):
        yield
