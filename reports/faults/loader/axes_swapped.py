"""Planted fault: the mesh loader exchanges y and z."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rayproof.cases import mesh_file
from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced


@FAULTS.register("loader/axes_swapped", where="loader", stage=None)
@contextmanager
def axes_swapped() -> Iterator[None]:
    """Spoil what every renderer is given."""
    right = mesh_file.read_mesh

    def wrong(*asked: Any) -> tuple[Any, Any]:
        vertices, faces = right(*asked)
        return vertices[:, [0, 2, 1]], faces

    with replaced(right, wrong):
        yield
