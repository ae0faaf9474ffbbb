"""Planted fault: the mesh loader rounds to 16 bits."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from rayproof.cases import mesh_file
from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced


@FAULTS.register("loader/half_precision", where="loader", stage=None)
@contextmanager
def half_precision() -> Iterator[None]:
    """Spoil what every renderer is given."""
    right = mesh_file.read_mesh

    def wrong(*asked: Any) -> tuple[Any, Any]:
        vertices, faces = right(*asked)
        return vertices.astype(np.float16).astype(np.float64), faces

    with replaced(right, wrong):
        yield
