"""Planted fault: 0 / 0 in a face's plane kept by the comparisons (erratum E15); the right form never divides it."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.intersections import INTERSECTIONS
from rayproof.tracer.rays import Interval, Ray


@INTERSECTIONS.register(
    "cube/fault_nan_kept",
    covers=("HIT-3",),
    kind="fault",
    stage=Stage.OBJECT,
    equivalent="0 / 0 needs a ray in the plane of a face, which sees that face edge-on, as an outline, where hit "
    "and miss are both right, and a NaN lies in no interval; elsewhere x / 0 is an infinity of the right sign",
    space="object",
)
def fault_nan_kept(ray: Ray, cube: Any, interval: Interval) -> Any:
    """Return the slab test's t, lost where a ray runs in a face's plane."""
    t_near, t_far = -dr.inf, dr.inf
    for origin, direction in zip(ray.origin, ray.direction, strict=True):
        t0 = (-cube.half - origin) / direction
        t1 = (cube.half - origin) / direction
        swap = t0 > t1
        enter, leave = dr.select(swap, t1, t0), dr.select(swap, t0, t1)
        t_near = dr.select(t_near >= enter, t_near, enter)
        t_far = dr.select(t_far <= leave, t_far, leave)
    return dr.select(t_near > t_far, dr.inf, interval.smallest(t_near, t_far))
