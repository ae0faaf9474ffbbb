"""The two roots of A t^2 - 2 h t + C = 0, as ray and sphere need them."""

from typing import Any

import drjit as dr


def ordered(one: Any, other: Any) -> tuple[Any, Any]:
    """Return the two, the smaller first."""
    swap = one > other
    return dr.select(swap, other, one), dr.select(swap, one, other)


def stable_roots(A: Any, h: Any, C: Any, root: Any) -> tuple[Any, Any]:
    """Return the roots in order; `root` is the square root of h^2 - A C.

    Source: Blinn, "How to Solve a Quadratic Equation", IEEE Computer Graphics and Applications (2005 and 2006).
    """
    # The root farther from zero never cancels; the product of the roots, C / A, gives the other one. A sign of 0 would
    # lose it where h = 0: copysign has none.
    q = h + dr.copysign(root, h)
    return ordered(dr.select(q == 0, 0, C / q), q / A)
