"""Planted fault: the record names the wrong renderer as the one whose edges and limits it goes by."""

from collections.abc import Iterator
from contextlib import contextmanager

from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import altered
from rayproof.reports.judge import adjudication


@FAULTS.register("judge/baseline_misnamed", where="judge", stage=None)
@contextmanager
def baseline_misnamed() -> Iterator[None]:
    """Name a renderer that is no oracle."""
    with altered(adjudication, "ORACLE", "mitsuba_scalar"):
        yield
