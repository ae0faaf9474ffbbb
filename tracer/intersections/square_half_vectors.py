"""Ray and square by its half-width and half-height vectors, in world space and without a transform.

The lecture's two dot tests hold for orthogonal vectors; under shear the 2x2 Gram system gives the coordinates.
"""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.intersections import INTERSECTIONS
from rayproof.tracer.rays import Interval, Ray


@INTERSECTIONS.register("square/half_vectors", covers=("HIT-8",), kind="right", stage=Stage.OBJECT, space="world")
def half_vectors(ray: Ray, square: Any, interval: Interval) -> Any:
    """Return the t of the plane's hit if it lies in the square and inside the interval, or inf."""
    w, h = square.half_width, square.half_height
    N = dr.cross(w, h)
    from_center = ray.origin - square.center
    slope = dr.dot(N, ray.direction)
    parallel = slope == 0
    t = -dr.dot(N, from_center) / dr.select(parallel, 1, slope)
    P = dr.fma(ray.direction, t, from_center)
    along_w, along_h = dr.dot(P, w), dr.dot(P, h)
    ww, hh = dr.squared_norm(w), dr.squared_norm(h)
    if square.orthogonal:
        inside = (abs(along_w) < ww) & (abs(along_h) < hh)
    else:
        wh = dr.dot(w, h)
        determinant = ww * hh - wh * wh
        x = hh * along_w - wh * along_h
        y = ww * along_h - wh * along_w
        inside = (abs(x) < determinant) & (abs(y) < determinant)
    return dr.select(interval.contains(t) & inside & ~parallel, t, dr.inf)
