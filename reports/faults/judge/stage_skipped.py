"""Planted fault: exitance is silently not compared."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rayproof.cases.stages import Stage
from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced
from rayproof.reports.judge import judging


@FAULTS.register("judge/stage_skipped", where="judge", stage=None)
@contextmanager
def stage_skipped() -> Iterator[None]:
    """Leave one planned stage out."""
    right = judging._checks

    def wrong(bench: Any, stages: Any, *rest: Any) -> Any:
        return right(bench, [stage for stage in stages if stage is not Stage.EXITANCE], *rest)

    with replaced(right, wrong):
        yield
