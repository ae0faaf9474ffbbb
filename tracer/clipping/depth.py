"""Clipping by the frustum's near and far planes."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.clipping import CLIPPING


@CLIPPING.register("clip_depth/planes", covers=("HIT-2",), kind="right", stage=Stage.OBJECT, default=True)
def planes(direction: Any, forward: Any, near: Any, far: Any) -> tuple[Any, Any]:
    """Return the t [m] of the two planes: near < t dot(d, F) < far."""
    cosine = dr.dot(direction, forward)
    per_depth = 1 / cosine
    return near * per_depth, far * per_depth
