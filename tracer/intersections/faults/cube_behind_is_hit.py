"""Planted fault: a cube behind the eye hit from its far side, distances made positive."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.intersections import INTERSECTIONS
from rayproof.tracer.rays import Interval, Ray


@INTERSECTIONS.register(
    "cube/fault_behind_is_hit",
    covers=("HIT-3",),
    kind="fault",
    says="hits cubes behind the eye",
    cases=("behind/cube", "behind/all_lit"),
    stage=Stage.OBJECT,
    also=(Stage.DISTANCE,),
    space="object",
)
def fault_behind_is_hit(ray: Ray, cube: Any, interval: Interval) -> Any:
    """Return the smaller of |entry| and |exit| inside the interval."""
    t_near, t_far = -dr.inf, dr.inf
    for origin, direction in zip(ray.origin, ray.direction, strict=True):
        parallel = direction == 0
        inside = abs(origin) <= cube.half
        t0 = (-cube.half - origin) / direction
        t1 = (cube.half - origin) / direction
        swap = t0 > t1
        enter, leave = dr.select(swap, t1, t0), dr.select(swap, t0, t1)
        enter = dr.select(parallel, dr.select(inside, -dr.inf, dr.inf), enter)
        leave = dr.select(parallel, dr.inf, leave)
        t_near = dr.select(enter > t_near, enter, t_near)
        t_far = dr.select(leave < t_far, leave, t_far)
    return dr.select(t_near <= t_far, interval.smallest(abs(t_near), abs(t_far)), dr.inf)
