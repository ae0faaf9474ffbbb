"""Planted fault: negative t accepted: what is behind the eye is seen."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.clipping import CLIPPING


@CLIPPING.register(
    "clip_none/fault_behind",
    covers=("HIT-2",),
    kind="fault",
    cases=("behind/*",),
    stage=Stage.OBJECT,
    also=(Stage.DISTANCE,),
)
def fault_behind(direction: Any, forward: Any, near: Any, far: Any) -> tuple[Any, Any]:
    """Return -inf and inf."""
    return type(near)(-dr.inf), type(near)(dr.inf)
