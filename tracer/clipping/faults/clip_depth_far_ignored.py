"""Planted fault: nothing is ever too far away."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.clipping import CLIPPING


@CLIPPING.register("clip_depth/fault_far_ignored", covers=("HIT-2",), kind="fault", stage=Stage.OBJECT)
def fault_far_ignored(direction: Any, forward: Any, near: Any, far: Any) -> tuple[Any, Any]:
    """Return the near plane's t [m] and inf."""
    return near / dr.dot(direction, forward), type(near)(dr.inf)
