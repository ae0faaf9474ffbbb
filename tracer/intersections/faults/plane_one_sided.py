"""Planted fault: the plane's back not hit."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.intersections import INTERSECTIONS
from rayproof.tracer.rays import Interval, Ray


@INTERSECTIONS.register(
    "plane/fault_one_sided",
    covers=("HIT-4",),
    kind="fault",
    says="hits planes from the front alone",
    stage=Stage.OBJECT,
    space="object",
)
def fault_one_sided(ray: Ray, plane: Any, interval: Interval) -> Any:
    """Return t where the ray runs against the plane's normal, or inf."""
    t = -ray.origin.z / dr.select(ray.direction.z == 0, 1, ray.direction.z)
    return dr.select(interval.contains(t) & (ray.direction.z < 0), t, dr.inf)
