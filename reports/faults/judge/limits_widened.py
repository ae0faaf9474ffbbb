"""Planted faults: all limits, one stage's limit or the references' constants are a little too wide."""

from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import replace
from typing import Any

from rayproof.cases.rounding import gamma
from rayproof.cases.stages import Stage
from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import altered, replaced
from rayproof.reports.judge import calibration, limits

STAGES = (Stage.RAY, Stage.DISTANCE, Stage.POSITION, Stage.NORMAL, Stage.IRRADIANCE, Stage.EXITANCE, Stage.RADIANCE)


@FAULTS.register("judge/limit_times_10", where="judge", stage=None)
@contextmanager
def limit_times_10() -> Iterator[None]:
    """Scale the unit roundoff by 10."""

    def wrong(roundoff: Any, count: float) -> float:
        return 10 * roundoff.scale * gamma(count, precision=roundoff.precision)

    with altered(limits.Roundoff, "__call__", wrong):
        yield


@contextmanager
def _of_one_stage(stage: Stage) -> Iterator[None]:
    """Scale both of a stage's limits by 100, as they leave `limits`."""
    right = limits.limits

    def wrong(*arguments: Any, **options: Any) -> Any:
        found = right(*arguments, **options)
        wide = {
            name: {s: (100 if s is stage else 1) * limit for s, limit in getattr(found, name).items()}
            for name in ("continued", "end_to_end")
        }
        return replace(found, **wide)

    with replaced(right, wrong):
        yield


def _register(stage: Stage) -> None:
    def planted() -> AbstractContextManager[None]:
        """Scale the stage's limits."""
        return _of_one_stage(stage)

    FAULTS.register(f"judge/{stage}_limit_times_100", where="judge", stage=None)(planted)


for each in STAGES:
    _register(each)


@FAULTS.register("judge/calibration_times_100", where="judge", stage=None)
@contextmanager
def calibration_times_100() -> Iterator[None]:
    """Give every reference that has a constant one of 100."""
    wide = {name: replace(constant, factor=100.0) for name, constant in calibration.CALIBRATED.items()}
    with altered(calibration, "CALIBRATED", wide):
        yield
