"""How far a computed hit point may lie from the true surface, along the surface's normal [m].

Let S = abs(eye) + t + extent, where `extent` bounds the shape's distance from the world's origin and its size. The
point fl(eye + t d) is off by one rounding, at most u S. The t of a formula that is as good as its inputs deserve is
off by a small multiple of u S / abs(dot(n, d)) (the condition number of ray and surface), and multiplied by
abs(dot(n, d)) that is again a small multiple of u S along the normal, however grazing the ray. Counting the roundings
of plane and cube (subtract, three fused products, one division: gamma(5) of o and of t d) and adding those of the
feeler's own intersection test gives 12 u S; the sphere's measured worst error is of the same size. FACTOR rounds up.

Two things multiply it (`TracedShape.spreads`): the transform of a curved surface, by at most norm(abs(A^-1)) norm(A),
and a slender triangle, by the product of two edges over twice its area.
"""

import math
from functools import lru_cache
from typing import Any

from rayproof.cases.rounding import UNIT_ROUNDOFF
from rayproof.cases.scene import Shape
from rayproof.tracer.shapes.kinds import traced

FACTOR = 16.0


def bound(*, scale: Any, spread: Any, precision: str) -> Any:
    """Return a bound on the clearance [m] anywhere in a scene whose largest absolute coordinate is `scale` [m].

    A point lies within sqrt(3) scale of the world's origin and two points within twice that of each other, so that
    abs(eye), t and extent (a distance plus a size) add up to at most 5 sqrt(3) scale.
    """
    return clearance(5 * math.sqrt(3) * scale, spread=spread, precision=precision)


def clearance(scale: Any, *, spread: Any, precision: str) -> Any:
    """Return FACTOR u spread scale [m]; `scale` is S [m]."""
    return scale * (FACTOR * UNIT_ROUNDOFF[precision]) * spread


@lru_cache(maxsize=32)  # a scene is rendered by one configuration after another
def extent(shape: Shape) -> float:
    """Return a bound on distance from the world's origin plus size [m]; of a plane, of its own origin only."""
    return traced(shape).extent()
