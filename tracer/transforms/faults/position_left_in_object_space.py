"""Planted fault: the hit point left in object space."""

from collections.abc import Callable
from typing import Any

from rayproof.cases.stages import Stage
from rayproof.tracer.rays import Ray
from rayproof.tracer.transforms import TRANSFORMS


@TRANSFORMS.register(
    "position/fault_left_in_object_space",
    covers=("XF-2",),
    kind="fault",
    says="leaves hit points in object space",
    stage=Stage.POSITION,
)
def fault_left_in_object_space(ray: Ray, distance: Any, object_ray: Callable[[], Any]) -> Any:
    """Return the object-space hit point [m]."""
    local, _ = object_ray()
    return local.at(distance)
