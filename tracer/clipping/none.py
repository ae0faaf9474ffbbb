"""No clipping: everything in front of the eye counts."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.clipping import CLIPPING


@CLIPPING.register("clip_none/in_front", covers=("HIT-2",), kind="right", stage=Stage.OBJECT, default=True)
def in_front(direction: Any, forward: Any, near: Any, far: Any) -> tuple[Any, Any]:
    """Return 0 and inf [m]."""
    return type(near)(0), type(near)(dr.inf)
