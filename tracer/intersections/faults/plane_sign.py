"""Planted fault: the sign of the plane's equation turned round."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.intersections import INTERSECTIONS
from rayproof.tracer.rays import Interval, Ray


@INTERSECTIONS.register(
    "plane/fault_sign",
    covers=("HIT-4",),
    kind="fault",
    says="has a sign wrong in the plane's intersection",
    stage=Stage.OBJECT,
    also=(Stage.DISTANCE,),
    space="object",
)
def fault_sign(ray: Ray, plane: Any, interval: Interval) -> Any:
    """Return the t of the plane's mirror image behind the eye."""
    parallel = ray.direction.z == 0
    t = ray.origin.z / dr.select(parallel, 1, ray.direction.z)
    return dr.select(interval.contains(t) & ~parallel, t, dr.inf)
