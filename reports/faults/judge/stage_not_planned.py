"""Planted fault: normal is neither planned nor compared."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rayproof.cases.stages import Stage
from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced
from rayproof.reports.judge import oracle


@FAULTS.register("judge/stage_not_planned", where="judge", stage=None)
@contextmanager
def stage_not_planned() -> Iterator[None]:
    """Forget one stage where the plan is made."""
    right = oracle.stages_of

    def wrong(scene: Any) -> tuple[Stage, ...]:
        return tuple(stage for stage in right(scene) if stage is not Stage.NORMAL)

    with replaced(right, wrong):
        yield
