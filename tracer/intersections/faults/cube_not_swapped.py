"""Planted fault: entry and exit of a slab not swapped for rays that run towards -x, -y or -z."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.intersections import INTERSECTIONS
from rayproof.tracer.rays import Interval, Ray


@INTERSECTIONS.register(
    "cube/fault_not_swapped",
    covers=("HIT-3",),
    kind="fault",
    says="does not swap the slabs' ends where a ray runs the other way",
    stage=Stage.OBJECT,
    space="object",
)
def fault_not_swapped(ray: Ray, cube: Any, interval: Interval) -> Any:
    """Return the slab test's t for rays of one octant."""
    t_near, t_far = -dr.inf, dr.inf
    for origin, direction in zip(ray.origin, ray.direction, strict=True):
        parallel = direction == 0
        inside = abs(origin) <= cube.half
        enter = dr.select(parallel, dr.select(inside, -dr.inf, dr.inf), (-cube.half - origin) / direction)
        leave = dr.select(parallel, dr.inf, (cube.half - origin) / direction)
        t_near = dr.select(enter > t_near, enter, t_near)
        t_far = dr.select(leave < t_far, leave, t_far)
    return dr.select(t_near <= t_far, interval.smallest(t_near, t_far), dr.inf)
