"""Control for erratum E11: the plane's division without a test for parallel rays."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.intersections import INTERSECTIONS
from rayproof.tracer.rays import Interval, Ray


@INTERSECTIONS.register(
    "plane/unguarded",
    covers=("HIT-4",),
    kind="control",
    stage=Stage.OBJECT,
    erratum="E11",
    equivalent="a parallel ray gives t = -inf, inf or NaN, and none of these lies inside an open interval",
    space="object",
)
def unguarded(ray: Ray, plane: Any, interval: Interval) -> Any:
    """Return -z / z_d even where z_d = 0."""
    t = -ray.origin.z / ray.direction.z
    return dr.select(interval.contains(t), t, dr.inf)
