"""Planted fault: only the entry looked at: from inside the cube nothing is met."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.intersections import INTERSECTIONS
from rayproof.tracer.rays import Interval, Ray


@INTERSECTIONS.register(
    "cube/fault_entry_alone",
    covers=("HIT-3",),
    kind="fault",
    says="takes where a ray enters a cube, and never where it leaves it",
    stage=Stage.OBJECT,
    also=(Stage.DISTANCE,),
    space="object",
)
def fault_entry_alone(ray: Ray, cube: Any, interval: Interval) -> Any:
    """Return the entry's t, if inside the interval, or inf."""
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
    return dr.select((t_near <= t_far) & interval.contains(t_near), t_near, dr.inf)
