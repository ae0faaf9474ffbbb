"""Planted fault: the panel's matrix has its rows where its columns belong."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import altered
from rayproof.reports.judge.matrix import Matrix


@FAULTS.register("judge/matrix_transposed", where="judge", stage=None)
@contextmanager
def matrix_transposed() -> Iterator[None]:
    """Transpose both tables of the record."""
    right = Matrix.as_json

    def wrong(self: Any) -> Any:
        told = right(self)
        return told | {name: [list(row) for row in zip(*told[name], strict=True)] for name in ("ratio", "differing")}

    with altered(Matrix, "as_json", wrong):
        yield
