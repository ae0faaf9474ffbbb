"""Planted fault: the panel's matrix names its rows and columns in another order."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import altered
from rayproof.reports.judge.matrix import Matrix


@FAULTS.register("judge/renderers_misnamed", where="judge", stage=None)
@contextmanager
def renderers_misnamed() -> Iterator[None]:
    """Shift the names by one."""
    right = Matrix.as_json

    def wrong(self: Any) -> Any:
        told = right(self)
        return told | {"renderers": [*told["renderers"][1:], *told["renderers"][:1]]}

    with altered(Matrix, "as_json", wrong):
        yield
