"""Ray and bounding box, never missing a box that exact arithmetic would hit.

Source: Ize, "Robust BVH Ray Traversal", Journal of Computer Graphics Techniques 2 (2013): the far end is widened by
2 gamma(3). A direction component of 0 is replaced by a tiny one, so that 0 * inf makes no NaN.
"""

from typing import Any

import drjit as dr

from cases.rounding import gamma

TINY = 2.0**-100  # far below any component of a direction that matters, and its inverse is finite in float32


def reciprocal(direction: Any) -> Any:
    """Return 1 / direction per component, finite."""
    return type(direction)(*(1 / dr.select(abs(d) < TINY, dr.copysign(type(d)(TINY), d), d) for d in direction))


def entry(lower: Any, upper: Any, origin: Any, inverse: Any, *, precision: str) -> tuple[Any, Any]:
    """Return the t of entry and exit, with exit < entry where the box is missed."""
    enter: Any = None
    leave: Any = None
    for low, high, start, factor in zip(lower, upper, origin, inverse, strict=True):
        t0, t1 = (low - start) * factor, (high - start) * factor
        swap = t0 > t1
        near, far = dr.select(swap, t1, t0), dr.select(swap, t0, t1)
        enter = near if enter is None else dr.select(near > enter, near, enter)
        leave = far if leave is None else dr.select(far < leave, far, leave)
    return enter, leave * (1 + 2 * gamma(3, precision=precision))
