"""Ray and the plane z = 0 of object space."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.intersections import INTERSECTIONS
from rayproof.tracer.rays import Interval, Ray


@INTERSECTIONS.register(
    "plane/dot_products", covers=("HIT-4",), kind="right", stage=Stage.OBJECT, default=True, space="object"
)
def dot_products(ray: Ray, plane: Any, interval: Interval) -> Any:
    """Return dot(N, S - R0) / dot(N, Rd) with N = (0, 0, 1) and S = 0, if inside the interval, or inf."""
    parallel = ray.direction.z == 0
    t = -ray.origin.z / dr.select(parallel, 1, ray.direction.z)
    return dr.select(interval.contains(t) & ~parallel, t, dr.inf)
