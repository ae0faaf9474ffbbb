"""Planted fault: a slab that the ray runs parallel to is passed over, whether the ray is inside it or not."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.intersections import INTERSECTIONS
from rayproof.tracer.rays import Interval, Ray


@INTERSECTIONS.register(
    "cube/fault_parallel_ignored",
    covers=("HIT-3",),
    kind="fault",
    says="hits cubes beside which a ray runs parallel to a face",
    cases=("parallel_rays/cubes",),
    stage=Stage.OBJECT,
    also=(Stage.DISTANCE,),
    space="object",
)
def fault_parallel_ignored(ray: Ray, cube: Any, interval: Interval) -> Any:
    """Return the slab test's t without containment in parallel slabs."""
    t_near, t_far = -dr.inf, dr.inf
    for origin, direction in zip(ray.origin, ray.direction, strict=True):
        parallel = direction == 0
        t0 = (-cube.half - origin) / direction
        t1 = (cube.half - origin) / direction
        swap = t0 > t1
        enter, leave = dr.select(swap, t1, t0), dr.select(swap, t0, t1)
        enter = dr.select(parallel, -dr.inf, enter)
        leave = dr.select(parallel, dr.inf, leave)
        t_near = dr.select(enter > t_near, enter, t_near)
        t_far = dr.select(leave < t_far, leave, t_far)
    return dr.select(t_near <= t_far, interval.smallest(t_near, t_far), dr.inf)
