"""Planted fault: the mesh loader's indices are off by one."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from rayproof.cases import mesh_file
from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced


@FAULTS.register("loader/index_from_one", where="loader", stage=None)
@contextmanager
def index_from_one() -> Iterator[None]:
    """Spoil what every renderer is given."""
    right = mesh_file.read_mesh

    def wrong(*asked: Any) -> tuple[Any, Any]:
        vertices, faces = right(*asked)
        return np.roll(vertices, 1, axis=0), faces

    with replaced(right, wrong):
        yield
