"""Planted fault: the references' constants multiplied by 1000."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced
from rayproof.reports.judge import calibration


@FAULTS.register("judge/calibration_times_1000", where="judge", stage=None)
@contextmanager
def calibration_times_1000() -> Iterator[None]:
    """Give every reference a constant of 1000."""
    right = calibration.calibration

    def wrong(reference: str) -> Any:
        return replace(right(reference), factor=1000.0)

    with replaced(right, wrong):
        yield
