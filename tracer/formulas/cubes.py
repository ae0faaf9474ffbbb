"""Formulas of ray and cube [-half, half]^3 of object space: slabs.

Unless stated otherwise, every function returns the smaller of entry and exit t inside the interval, or inf.
"""

from typing import Any

import drjit as dr

from rayproof.cases.rounding import gamma
from rayproof.tracer.kernel.arithmetic import ordered
from rayproof.tracer.rays import Interval, Ray


def slabs(ray: Ray, cube: Any, interval: Interval) -> Any:
    """Return the smaller of entry and exit t inside the interval, or inf.

    Source: Kay and Kajiya, "Ray Tracing Complex Scenes" (1986), in the lecture's form. A parallel ray is decided by
    containment, without a division (erratum E15), and the interval decides between entry and exit (E4).
    """
    t_near, t_far = -dr.inf, dr.inf
    for origin, direction in zip(ray.origin, ray.direction, strict=True):
        parallel = direction == 0
        inside = abs(origin) <= cube.half
        t0 = (-cube.half - origin) / direction
        t1 = (cube.half - origin) / direction
        swap = t0 > t1
        enter, leave = dr.select(swap, t1, t0), dr.select(swap, t0, t1)
        # A parallel ray inside the slab is never bounded by it; outside it meets nothing.
        enter = dr.select(parallel, dr.select(inside, -dr.inf, dr.inf), enter)
        leave = dr.select(parallel, dr.inf, leave)
        # These propagate a NaN; a choice by comparison would drop it and bound the ray by the other slabs alone.
        t_near = dr.maximum(t_near, enter)
        t_far = dr.minimum(t_far, leave)
    return dr.select(t_near <= t_far, interval.smallest(t_near, t_far), dr.inf)


def entry_only(ray: Ray, cube: Any, interval: Interval) -> Any:
    """Return t_near wherever t_near <= t_far: a cube behind the eye is hit, and so is its back from inside.

    Control for erratum E4: the slab test ends at t_near > t_far.
    """
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


def divides_anyway(ray: Ray, cube: Any, interval: Interval) -> Any:
    """Return the slab test's t with 0 / 0 where a parallel ray runs inside a face's plane.

    Control for erratum E15: the slab's parallel test is followed by the division.
    """
    t_near, t_far = -dr.inf, dr.inf
    missed: Any = False
    for origin, direction in zip(ray.origin, ray.direction, strict=True):
        missed = missed | ((direction == 0) & (abs(origin) > cube.half))
        t0 = (-cube.half - origin) / direction
        t1 = (cube.half - origin) / direction
        swap = t0 > t1
        enter, leave = dr.select(swap, t1, t0), dr.select(swap, t0, t1)
        t_near = dr.select(enter > t_near, enter, t_near)
        t_far = dr.select(leave < t_far, leave, t_far)
    return dr.select((t_near <= t_far) & ~missed, interval.smallest(t_near, t_far), dr.inf)


def parallel_branch(ray: Ray, cube: Any, interval: Interval) -> Any:
    """Return the smaller of entry and exit t inside the interval, or inf.

    By slabs with a branch for parallel rays, and one reciprocal for both faces of a slab.
    Source: Kay and Kajiya, "Ray Tracing Complex Scenes", SIGGRAPH 1986; the branch as in the lecture.
    """
    t_near, t_far = -dr.inf, dr.inf
    for origin, direction in zip(ray.origin, ray.direction, strict=True):
        parallel = direction == 0
        inside = abs(origin) <= cube.half
        factor = 1 / direction
        enter, leave = ordered((-cube.half - origin) * factor, (cube.half - origin) * factor)
        enter = dr.select(parallel, dr.select(inside, -dr.inf, dr.inf), enter)
        leave = dr.select(parallel, dr.inf, leave)
        # These propagate a NaN; a choice by comparison would drop it and bound the ray by the other slabs alone.
        t_near = dr.maximum(t_near, enter)
        t_far = dr.minimum(t_far, leave)
    return dr.select(t_near <= t_far, interval.smallest(t_near, t_far), dr.inf)


def ieee_slabs(ray: Ray, cube: Any, interval: Interval) -> Any:
    """Return the slabs' t by minimum and maximum; a NaN in any of them is a miss.

    By slabs and IEEE infinities, without any branch: a control.
    Sources: Smits, "Efficiency Issues for Ray Tracing", Journal of Graphics Tools 3 (1998); Williams, Barrus, Morley
    and Shirley, "An Efficient and Robust Ray-Box Intersection Algorithm", Journal of Graphics Tools 10 (2005).
    """
    t_near, t_far = -dr.inf, dr.inf
    for origin, direction in zip(ray.origin, ray.direction, strict=True):
        factor = 1 / direction
        t0, t1 = (-cube.half - origin) * factor, (cube.half - origin) * factor
        t_near = dr.maximum(t_near, dr.minimum(t0, t1))
        t_far = dr.minimum(t_far, dr.maximum(t0, t1))
    return dr.select(t_near <= t_far, interval.smallest(t_near, t_far), dr.inf)


def division(ray: Ray, cube: Any, interval: Interval) -> Any:
    """Return the slabs' t by division, minimum and maximum; a NaN in any of them is a miss.

    By slabs and IEEE infinities, divided instead of multiplied by a reciprocal: a control.
    One rounding less than `cube/ieee_slabs`, which halves an outline's wrong pixels and leaves the NaN as it is.
    """
    t_near, t_far = -dr.inf, dr.inf
    for origin, direction in zip(ray.origin, ray.direction, strict=True):
        t0, t1 = (-cube.half - origin) / direction, (cube.half - origin) / direction
        t_near = dr.maximum(t_near, dr.minimum(t0, t1))
        t_far = dr.minimum(t_far, dr.maximum(t0, t1))
    return dr.select(t_near <= t_far, interval.smallest(t_near, t_far), dr.inf)


def ize(ray: Ray, cube: Any, interval: Interval) -> Any:
    """Return the slabs' t with t_far times 1 + 2 gamma(3).

    By slabs with a far end that is moved away, so that no box is missed by rounding: a control.
    It is meant for culling, where a false hit costs nothing. As a hit test it reports rays that pass just outside.
    Source: Ize, "Robust BVH Ray Traversal", Journal of Computer Graphics Techniques 2 (2013), with PBRT's 2 gamma(3).
    """
    precision = "float64" if dr.type_v(ray.direction) == dr.VarType.Float64 else "float32"
    t_near, t_far = -dr.inf, dr.inf
    for origin, direction in zip(ray.origin, ray.direction, strict=True):
        factor = 1 / direction
        t0, t1 = (-cube.half - origin) * factor, (cube.half - origin) * factor
        t_near = dr.maximum(t_near, dr.minimum(t0, t1))
        t_far = dr.minimum(t_far, dr.maximum(t0, t1))
    t_far = t_far * (1 + 2 * gamma(3, precision=precision))
    return dr.select(t_near <= t_far, interval.smallest(t_near, t_far), dr.inf)


def nan_dropping(ray: Ray, cube: Any, interval: Interval) -> Any:
    """Return the slabs' t by fmin and fmax, which ignore a NaN operand.

    By slabs with minimum and maximum that drop a NaN: a control.
    Without the NaN only the infinity of the pair remains, and the box is missed instead of the slab being ignored.
    Source: Barnes, "Fast, Branchless Ray/Bounding Box Intersections, Part 2: NaNs" (2015).
    """
    t_near: Any = -dr.inf
    t_far: Any = dr.inf
    for origin, direction in zip(ray.origin, ray.direction, strict=True):
        factor = 1 / direction
        t0, t1 = (-cube.half - origin) * factor, (cube.half - origin) * factor
        t_near = dr.fmax(t_near, dr.fmin(t0, t1))
        t_far = dr.fmin(t_far, dr.fmax(t0, t1))
    return dr.select(t_near <= t_far, interval.smallest(t_near, t_far), dr.inf)
