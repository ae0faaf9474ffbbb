"""The hit point in world space, taken along the world ray."""

from collections.abc import Callable
from typing import Any

from rayproof.cases.stages import Stage
from rayproof.tracer.rays import Ray
from rayproof.tracer.transforms import TRANSFORMS


@TRANSFORMS.register("position/along_ray", covers=("XF-2",), kind="right", stage=Stage.POSITION, default=True)
def along_ray(ray: Ray, distance: Any, object_ray: Callable[[], Any]) -> Any:
    """Return R0 + t Rd [m]; t means the same in both spaces, so no matrix is needed."""
    return ray.at(distance)
