"""Ray and triangle by the signs of areas seen along the ray: no leak between triangles that share an edge.

Two neighbours compute a shared edge's area from the same two products, as x - y and as y - x, which are exact
negatives; that holds only as long as no compiler fuses the subtraction with a product.
Source: Woop, Benthin and Wald, "Watertight Ray/Triangle Intersection", Journal of Computer Graphics Techniques 2
(2013), without its culling and without its float64 fallback.
"""

from typing import Any

from rayproof.cases.stages import Stage
from rayproof.tracer.intersections import INTERSECTIONS
from rayproof.tracer.numerics.shear import distance, edge_functions, shear
from rayproof.tracer.rays import Interval, Ray


@INTERSECTIONS.register("triangle/woop", covers=("HIT-5",), kind="right", stage=Stage.OBJECT, space="world")
def woop(ray: Ray, triangle: Any, interval: Interval) -> Any:
    """Return t if the signed areas U, V and W do not differ in sign and t lies inside the interval, or inf."""
    sheared = shear(ray, triangle)
    return distance(sheared, edge_functions(sheared, lambda a, b, c, d: a * b - c * d), interval)
