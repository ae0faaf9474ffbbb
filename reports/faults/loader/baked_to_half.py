"""Planted fault: baked triangles are rounded to 16 bits."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from rayproof.cases import baking
from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced


@FAULTS.register("loader/baked_to_half", where="loader", stage=None)
@contextmanager
def baked_to_half() -> Iterator[None]:
    """Spoil the triangles that every renderer shares."""
    right = baking.world_triangles

    def wrong(shape: Any) -> Any:
        return right(shape).astype(np.float16).astype(np.float32)

    with replaced(right, wrong):
        yield
