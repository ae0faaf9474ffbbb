"""Planted fault: the mesh loader loses the last face."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rayproof.cases import mesh_file
from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced


@FAULTS.register("loader/face_dropped", where="loader", stage=None)
@contextmanager
def face_dropped() -> Iterator[None]:
    """Spoil what every renderer is given."""
    right = mesh_file.read_mesh

    def wrong(*asked: Any) -> tuple[Any, Any]:
        vertices, faces = right(*asked)
        return vertices, faces[:-1]

    with replaced(right, wrong):
        yield
