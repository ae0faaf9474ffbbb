"""Planted fault: baking leaves the winding of a mirrored mesh."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from rayproof.cases import baking
from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced


@FAULTS.register("loader/baked_winding", where="loader", stage=None)
@contextmanager
def baked_winding() -> Iterator[None]:
    """Spoil the triangles that every renderer shares."""
    right = baking.world_triangles

    def wrong(shape: Any) -> Any:
        return right(shape)[:, [0, 2, 1]] if np.linalg.det(np.asarray(shape.to_world)[:3, :3]) < 0 else right(shape)

    with replaced(right, wrong):
        yield
