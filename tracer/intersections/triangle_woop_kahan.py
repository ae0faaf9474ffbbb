"""Ray and triangle by Woop's signed areas, each a difference of products in explicit fused operations.

No compiler can fuse these again. An area is off by 1.5 ulp at most, so that without underflow its sign is always right
for the sheared corners, and neighbours agree about their edge.
Sources: Woop, Benthin and Wald, "Watertight Ray/Triangle Intersection", Journal of Computer Graphics Techniques 2
(2013); Kahan (see `tracer.numerics.products`).
"""

from typing import Any

from rayproof.cases.stages import Stage
from rayproof.tracer.intersections import INTERSECTIONS
from rayproof.tracer.numerics.products import difference_of_products
from rayproof.tracer.numerics.shear import distance, edge_functions, shear
from rayproof.tracer.rays import Interval, Ray


@INTERSECTIONS.register(
    "triangle/woop_kahan", covers=("HIT-5",), kind="right", stage=Stage.OBJECT, default=True, space="world"
)
def woop_kahan(ray: Ray, triangle: Any, interval: Interval) -> Any:
    """Return t if the signed areas U, V and W do not differ in sign and t lies inside the interval, or inf."""
    sheared = shear(ray, triangle)
    return distance(sheared, edge_functions(sheared, difference_of_products), interval)
