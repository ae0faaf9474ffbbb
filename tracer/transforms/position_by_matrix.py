"""The hit point in world space, taken from object space by the model matrix."""

from collections.abc import Callable
from typing import Any

from rayproof.cases.stages import Stage
from rayproof.tracer.rays import Ray
from rayproof.tracer.transforms import TRANSFORMS


@TRANSFORMS.register("position/by_matrix", covers=("XF-2",), kind="right", stage=Stage.POSITION)
def by_matrix(ray: Ray, distance: Any, object_ray: Callable[[], Any]) -> Any:
    """Return the model matrix times the object-space hit point [m]."""
    local, to_world = object_ray()
    return to_world(local.at(distance))
