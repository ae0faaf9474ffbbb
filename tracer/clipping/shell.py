"""The lecture's clipping by distance, where the scene asks for it."""

from typing import Any

from rayproof.cases.stages import Stage
from rayproof.tracer.clipping import CLIPPING


@CLIPPING.register("clip_shell/distance", covers=("HIT-2",), kind="right", stage=Stage.OBJECT, default=True)
def distance(direction: Any, forward: Any, near: Any, far: Any) -> tuple[Any, Any]:
    """Return near and far [m]: near < t < far."""
    return near, far
