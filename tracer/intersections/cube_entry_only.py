"""Control for erratum E4: the slab test ends at t_near > t_far."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.intersections import INTERSECTIONS
from rayproof.tracer.rays import Interval, Ray


@INTERSECTIONS.register(
    "cube/entry_only",
    covers=("HIT-3",),
    kind="control",
    says="takes where a ray enters a cube, behind the eye too",
    stage=Stage.OBJECT,
    erratum="E4",
    space="object",
)
def entry_only(ray: Ray, cube: Any, interval: Interval) -> Any:
    """Return t_near wherever t_near <= t_far: a cube behind the eye is hit, and so is its back from inside."""
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
    return dr.select(t_near <= t_far, t_near, dr.inf)
