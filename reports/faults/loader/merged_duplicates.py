"""Planted fault: the mesh loader joins vertices that are near each other."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from rayproof.cases import mesh_file
from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced


@FAULTS.register("loader/merged_duplicates", where="loader", stage=None)
@contextmanager
def merged_duplicates() -> Iterator[None]:
    """Spoil what every renderer is given."""
    right = mesh_file.read_mesh

    def wrong(*asked: Any) -> tuple[Any, Any]:
        vertices, faces = right(*asked)
        return np.round(vertices, 3), faces

    with replaced(right, wrong):
        yield
