"""Planted fault: a slab that a ray runs parallel to counts as missed where the component is -0."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.intersections import INTERSECTIONS
from rayproof.tracer.rays import Interval, Ray


@INTERSECTIONS.register(
    "cube/fault_negative_zero",
    covers=("HIT-3",),
    kind="fault",
    says="misses cubes where a component of the direction is -0",
    cases=("parallel_rays/cubes_turned",),
    stage=Stage.OBJECT,
    also=(Stage.DISTANCE,),
    space="object",
)
def fault_negative_zero(ray: Ray, cube: Any, interval: Interval) -> Any:
    """Return the slab test's t where no component of the direction is -0, else inf."""
    t_near, t_far = -dr.inf, dr.inf
    for origin, direction in zip(ray.origin, ray.direction, strict=True):
        parallel = direction == 0
        inside = (abs(origin) <= cube.half) & ~(parallel & (1 / direction < 0))
        t0 = (-cube.half - origin) / direction
        t1 = (cube.half - origin) / direction
        swap = t0 > t1
        enter, leave = dr.select(swap, t1, t0), dr.select(swap, t0, t1)
        enter = dr.select(parallel, dr.select(inside, -dr.inf, dr.inf), enter)
        leave = dr.select(parallel, dr.inf, leave)
        t_near = dr.select(enter > t_near, enter, t_near)
        t_far = dr.select(leave < t_far, leave, t_far)
    return dr.select(t_near <= t_far, interval.smallest(t_near, t_far), dr.inf)
