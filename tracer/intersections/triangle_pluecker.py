"""Ray and triangle by Plücker coordinates: on which side of the ray each edge's line passes.

The two neighbours of an edge compute exact negatives of each other. Edges need not meet exactly in a corner.
Sources: Jones, "Intersecting a Ray and a Triangle with Plücker Coordinates", Ray Tracing News 13 (2000); the form with
corners relative to the eye is that of Embree, kernels/geometry/triangle_intersector_pluecker.h.
"""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.intersections import INTERSECTIONS
from rayproof.tracer.rays import Interval, Ray


@INTERSECTIONS.register(
    "triangle/pluecker",
    covers=("HIT-5",),
    kind="right",
    stage=Stage.OBJECT,
    leaks="edges need not meet exactly in a vertex",
    space="world",
)
def pluecker(ray: Ray, triangle: Any, interval: Interval) -> Any:
    """Return the t of the plane's hit if all edges pass on one side and t lies inside the interval, or inf."""
    D = ray.direction
    A, B, C = triangle.first - ray.origin, triangle.second - ray.origin, triangle.third - ray.origin
    CA, AB, BC = C - A, A - B, B - C
    U = dr.dot(dr.cross(CA, C + A), D)
    V = dr.dot(dr.cross(AB, A + B), D)
    W = dr.dot(dr.cross(BC, B + C), D)
    outside = ((U < 0) | (V < 0) | (W < 0)) & ((U > 0) | (V > 0) | (W > 0))
    N = dr.cross(AB, CA)
    slope = dr.dot(N, D)
    parallel = slope == 0
    t = dr.dot(N, A) / dr.select(parallel, 1, slope)
    return dr.select(interval.contains(t) & ~outside & ~parallel, t, dr.inf)
