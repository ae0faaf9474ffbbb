"""Planted fault: whatever differs, the tracer is blamed."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced
from rayproof.reports.judge import adjudicate


@FAULTS.register("judge/reference_never_suspect", where="judge", stage=None)
@contextmanager
def reference_never_suspect() -> Iterator[None]:
    """Adjudicate nothing."""
    right = adjudicate.adjudicate

    def wrong(*arguments: Any) -> None:
        return None

    with replaced(right, wrong):
        yield
