"""Planted fault: the exit code says that all is well."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced
from rayproof.reports.judge import outcomes


@FAULTS.register("run/exit_code_zero", where="run", stage=None)
@contextmanager
def exit_code_zero() -> Iterator[None]:
    """Exit with 0, whatever was found."""
    right = outcomes.exit_code

    def wrong(found: Any) -> int:
        return 0

    with replaced(right, wrong):
        yield
