"""Planted fault: a reference that repeats the tracer's output is believed."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rayproof.cases.stages import Stage
from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced
from rayproof.reports.judge import copies


@FAULTS.register("judge/copies_believed", where="judge", stage=None)
@contextmanager
def copies_believed() -> Iterator[None]:
    """Never notice a copy."""

    def wrong(*_: Any, **__: Any) -> tuple[Stage, ...]:
        return ()

    with replaced(copies.copied, wrong):
        yield
