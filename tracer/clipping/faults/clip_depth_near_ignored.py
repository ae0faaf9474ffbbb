"""Planted fault: everything in front of the eye counts, up to the far plane."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.clipping import CLIPPING


@CLIPPING.register("clip_depth/fault_near_ignored", covers=("HIT-2",), kind="fault", stage=Stage.OBJECT)
def fault_near_ignored(direction: Any, forward: Any, near: Any, far: Any) -> tuple[Any, Any]:
    """Return 0 and the far plane's t [m]."""
    return type(near)(0), far / dr.dot(direction, forward)
