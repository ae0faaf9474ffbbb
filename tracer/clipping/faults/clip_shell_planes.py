"""Planted fault: planes where the scene asks for a shell."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.clipping import CLIPPING


@CLIPPING.register(
    "clip_shell/fault_planes", covers=("HIT-2",), kind="fault", cases=("clipping/*_shell",), stage=Stage.OBJECT
)
def fault_planes(direction: Any, forward: Any, near: Any, far: Any) -> tuple[Any, Any]:
    """Return the t [m] of the frustum's planes."""
    cosine = dr.dot(direction, forward)
    return near / cosine, far / cosine
