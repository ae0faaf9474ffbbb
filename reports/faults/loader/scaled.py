"""Planted fault: the mesh loader takes metres for centimetres."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rayproof.cases import mesh_file
from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced


@FAULTS.register("loader/scaled", where="loader", stage=None)
@contextmanager
def scaled() -> Iterator[None]:
    """Spoil what every renderer is given."""
    right = mesh_file.read_mesh

    def wrong(*asked: Any) -> tuple[Any, Any]:
        vertices, faces = right(*asked)
        return vertices * 0.01, faces

    with replaced(right, wrong):
        yield
