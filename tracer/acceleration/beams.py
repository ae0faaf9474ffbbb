"""Several rays from one point, as one beam that is asked which boxes it meets.

For t >= 0 the beam of all directions between `low` and `high` meets the slab between l and h (seen from the origin) if
and only if t high >= l and t low <= h: on an axis whose directions are all positive that is an entry through l and an
exit through h, and where the sign changes two entries and no exit. Which of the four quotients bound t depends on the
signs alone, so that they are chosen once per beam; the others are 0 t -+ HUGE.

No box is missed that exact arithmetic would meet. Grid coordinates and directions are each off by less than 4 u, and
so is a quotient; every bound is moved outward by 16 u (2^16 + abs(origin)) steps over the direction. A comparison with
a NaN counts as met. Source of the aim: Ize, "Robust BVH Ray Traversal", Journal of Computer Graphics Techniques 2
(2013).
"""

from collections.abc import Sequence
from typing import Any

import drjit as dr

from cases.rounding import UNIT_ROUNDOFF
from tracer.acceleration.nodes import STEPS, Nodes

HUGE = 3e38
TINY = 2.0**-60  # grid steps per unit of t; a narrower beam is widened to it, which misses nothing
ROUNDINGS = 16.0


def smaller(a: Any, b: Any) -> Any:
    """Return the smaller; one instruction, where a minimum that propagates NaN takes several."""
    return dr.select(a < b, a, b)


def larger(a: Any, b: Any) -> Any:
    """Return the larger."""
    return dr.select(a > b, a, b)


def _bounds(slope: Any, applies: Any, origin: Any, *, otherwise: float) -> tuple[Any, Any]:
    """Return scale and offset of the quotient (x - origin) / slope, moved outward, where it applies."""
    scale = 1 / slope
    margin = abs(scale) * (abs(origin) + STEPS) * (ROUNDINGS * UNIT_ROUNDOFF["float32"])
    offset = -origin * scale + (margin if otherwise > 0 else -margin)
    return dr.select(applies, scale, 0), dr.select(applies, offset, otherwise)


def _range(components: Sequence[Any], active: Sequence[Any]) -> tuple[Any, Any]:
    """Return the smallest and the largest component of those that are active; of none an empty range."""
    if not active:
        low = high = components[0]
        for component in components[1:]:
            low, high = smaller(component, low), larger(component, high)
        return low, high
    low, high = type(components[0])(dr.inf), type(components[0])(-dr.inf)
    for component, counts in zip(components, active, strict=True):
        low = dr.select(counts & (component < low), component, low)
        high = dr.select(counts & (component > high), component, high)
    return low, high


class Beam:
    """What the rays of each lane have in common."""

    def __init__(self, nodes: Nodes, origin: Any, directions: Sequence[Any], *, active: Sequence[Any] = ()) -> None:
        """Bound `directions` from `origin` [m], all or those that are `active`; t counts from 0 on."""
        self._near: list[tuple[Any, Any]] = []
        self._far: list[tuple[Any, Any]] = []
        if not nodes.host.exact:
            return
        for axis in range(3):
            low, high = _range([direction[axis] for direction in directions], active)
            low, high = nodes.vector(axis, low), nodes.vector(axis, high)
            low, high = dr.select(abs(low) < TINY, -TINY, low), dr.select(abs(high) < TINY, TINY, high)
            start = nodes.point(axis, origin[axis])
            # The lower plane is met by the highest direction, the upper one by the lowest.
            self._near.append(
                (_bounds(high, high > 0, start, otherwise=-HUGE), _bounds(low, low < 0, start, otherwise=-HUGE))
            )
            self._far.append(
                (_bounds(high, high < 0, start, otherwise=HUGE), _bounds(low, low > 0, start, otherwise=HUGE))
            )

    def meets(self, box: tuple[list[Any], list[Any]], limit: Any) -> tuple[Any, Any]:
        """Return whether the box is met before t = `limit`, and the t of entry."""
        enter, leave = type(limit)(0), limit
        for (near_low, near_high), (far_low, far_high), low, high in zip(self._near, self._far, *box, strict=False):
            for (scale, offset), plane in ((near_low, low), (near_high, high)):
                enter = larger(dr.fma(plane, scale, offset), enter)
            for (scale, offset), plane in ((far_low, low), (far_high, high)):
                leave = smaller(dr.fma(plane, scale, offset), leave)
        return ~(enter > leave), enter
