"""Planted fault: the mesh loader moves one vertex by a millionth."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from rayproof.cases import mesh_file
from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced


@FAULTS.register("loader/last_vertex_moved", where="loader", stage=None)
@contextmanager
def last_vertex_moved() -> Iterator[None]:
    """Spoil what every renderer is given."""
    right = mesh_file.read_mesh

    def wrong(*asked: Any) -> tuple[Any, Any]:
        vertices, faces = right(*asked)
        return vertices + (np.arange(len(vertices)) == len(vertices) - 1)[:, np.newaxis] * 1e-6, faces

    with replaced(right, wrong):
        yield
