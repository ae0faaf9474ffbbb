"""Planted fault: closed forms are not looked at."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced
from rayproof.reports.judge import closed_forms


@FAULTS.register("judge/closed_forms_ignored", where="judge", stage=None)
@contextmanager
def closed_forms_ignored() -> Iterator[None]:
    """Judge no expectation."""
    right = closed_forms.closed_forms

    def wrong(*arguments: Any) -> list[Any]:
        return []

    with replaced(right, wrong):
        yield
