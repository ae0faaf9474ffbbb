"""Ray and triangle by Woop's signed areas, recomputed in float64 where one of them is 0.

In float64 the products of float32 numbers are exact, so that only exact ties stay ties. Both are computed for every
ray, because all lanes of a kernel do the same.
Source: Woop, Benthin and Wald, "Watertight Ray/Triangle Intersection", Journal of Computer Graphics Techniques 2
(2013), appendix.
"""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.intersections import INTERSECTIONS
from rayproof.tracer.numerics.float64 import in_float64
from rayproof.tracer.numerics.shear import distance, edge_functions, shear
from rayproof.tracer.rays import Interval, Ray


def _in_float64(a: Any, b: Any, c: Any, d: Any) -> Any:
    Float = type(a)
    return Float(in_float64(a) * in_float64(b) - in_float64(c) * in_float64(d))


@INTERSECTIONS.register(
    "triangle/woop_float64_fallback", covers=("HIT-5",), kind="right", stage=Stage.OBJECT, space="world"
)
def woop_float64_fallback(ray: Ray, triangle: Any, interval: Interval) -> Any:
    """Return t if the signed areas U, V and W do not differ in sign and t lies inside the interval, or inf."""
    sheared = shear(ray, triangle)
    U, V, W = edge_functions(sheared, lambda a, b, c, d: a * b - c * d)
    tie = (U == 0) | (V == 0) | (W == 0)
    exact = edge_functions(sheared, _in_float64)
    U, V, W = (dr.select(tie, better, area) for better, area in zip(exact, (U, V, W), strict=True))
    return distance(sheared, (U, V, W), interval)
