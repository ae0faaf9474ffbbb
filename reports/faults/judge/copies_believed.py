"""Planted fault: a reference that repeats the tracer's output is believed."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from cases.stages import Stage
from reports.faults import FAULTS
from reports.faults.patching import replaced
from reports.judge import copies


@FAULTS.register("judge/copies_believed", where="judge", stage=None)
@contextmanager
def copies_believed() -> Iterator[None]:
    """Never notice a copy."""

    def wrong(*_: Any, **__: Any) -> tuple[Stage, ...]:
        return ()

    with replaced(copies.copied, wrong):
        yield
