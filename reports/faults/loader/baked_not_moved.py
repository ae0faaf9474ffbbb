"""Planted fault: baking forgets the translation."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from rayproof.cases import baking
from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced


@FAULTS.register("loader/baked_not_moved", where="loader", stage=None)
@contextmanager
def baked_not_moved() -> Iterator[None]:
    """Spoil the triangles that every renderer shares."""
    right = baking.world_triangles

    def wrong(shape: Any) -> Any:
        return (right(shape) - np.asarray(shape.to_world)[:3, 3]).astype(np.float32)

    with replaced(right, wrong):
        yield
