"""Planted fault: a verdict found before is said again of whatever the renderer answers now."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from reports.cache import digests
from reports.faults import FAULTS
from reports.faults.patching import replaced


@FAULTS.register("run/verdict_of_any_answer", where="run", stage=None)
@contextmanager
def verdict_of_any_answer() -> Iterator[None]:
    """Leave the answers out of the question."""

    def wrong(value: Any) -> str:
        return value.name

    with replaced(digests.exact, wrong):
        yield
