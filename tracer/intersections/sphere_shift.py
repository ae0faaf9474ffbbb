"""Ray and sphere from the ray's closest point to the centre, where the quadratic is well scaled.

The near root of an eye close to the surface is the sum of two large numbers.
Source: Mitsuba 3, src/shapes/sphere.cpp (which does this in float64 on the CPU).
"""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.intersections import INTERSECTIONS
from rayproof.tracer.rays import Interval, Ray


@INTERSECTIONS.register("sphere/shift", covers=("HIT-1",), kind="right", stage=Stage.OBJECT, space="object")
def shift(ray: Ray, sphere: Any, interval: Interval) -> Any:
    """Return the smallest t inside the interval: that of the closest point, less or plus half the chord; or inf."""
    f = ray.origin - sphere.center
    A = dr.squared_norm(ray.direction)
    moved = -dr.dot(f, ray.direction) / A
    closest = dr.fma(ray.direction, moved, f)
    # What rounding left of the way to the exact foot of the perpendicular.
    left = -dr.dot(closest, ray.direction) / A
    closest = dr.fma(ray.direction, left, closest)
    half_chord_squared = (dr.square(sphere.radius) - dr.squared_norm(closest)) / A
    real = half_chord_squared >= 0
    half_chord = dr.sqrt(dr.select(real, half_chord_squared, 0))
    t = interval.smallest(moved + (left - half_chord), moved + (left + half_chord))
    return dr.select(real, t, dr.inf)
