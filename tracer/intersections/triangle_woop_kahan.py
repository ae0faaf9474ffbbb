"""Ray and triangle by Woop's signed areas, each a difference of products in explicit fused operations.

No compiler can fuse these again, and an area's sign is wrong for no underflow-free input, so that a ray through an edge
goes to one neighbour and hardly ever to both.
Sources: Woop, Benthin and Wald, "Watertight Ray/Triangle Intersection", Journal of Computer Graphics Techniques 2
(2013); Kahan (see `tracer.products`).
"""

from typing import Any

from cases.stages import Stage
from tracer.intersections import INTERSECTIONS
from tracer.products import difference_of_products
from tracer.rays import Interval, Ray
from tracer.shear import distance, edge_functions, shear


@INTERSECTIONS.register("triangle/woop_kahan", covers=("HIT-5",), kind="right", stage=Stage.OBJECT, space="world")
def woop_kahan(ray: Ray, triangle: Any, interval: Interval) -> Any:
    """Return t if the signed areas U, V and W do not differ in sign and t lies inside the interval, or inf."""
    sheared = shear(ray, triangle)
    return distance(sheared, edge_functions(sheared, difference_of_products), interval)
