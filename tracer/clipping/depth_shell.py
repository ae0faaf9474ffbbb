"""Control for erratum E2: near_clip < t < far_clip for the frustum's planes."""

from typing import Any

from rayproof.cases.stages import Stage
from rayproof.tracer.clipping import CLIPPING


@CLIPPING.register("clip_depth/shell", covers=("HIT-2",), kind="control", stage=Stage.OBJECT, erratum="E2")
def shell(direction: Any, forward: Any, near: Any, far: Any) -> tuple[Any, Any]:
    """Return near and far [m] themselves, a spherical shell around the eye."""
    return near, far
