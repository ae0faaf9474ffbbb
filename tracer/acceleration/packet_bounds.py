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

from collections.abc import Callable, Sequence
from typing import Any

import drjit as dr

from rayproof.cases.rounding import UNIT_ROUNDOFF
from rayproof.tracer.acceleration.grid_boxes import STEPS
from rayproof.tracer.acceleration.quantised_boxes import Nodes

HUGE = 3e38
TINY = 2.0**-60  # grid steps per unit of t; a narrower beam is widened to it, which misses nothing
# The same for a single ray, and what its largest component must exceed over the distance to go, in steps per t.
LEAST, SLOWEST = 2.0**-100, 2.0**-90
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


def reduced(choose: Callable[[Any, Any], Any], values: Sequence[Any]) -> Any:
    """Return the smallest or the largest of them, two by two: what depends on nothing is computed at once."""
    while len(values) > 1:
        pairs = [choose(*values[k : k + 2]) for k in range(0, len(values) - 1, 2)]
        values = [*pairs, *values[len(values) - len(values) % 2 :]]
    return values[0]


class Beam:
    """What the rays of each lane have in common; of a single ray it is known which plane it meets first."""

    def __init__(self, nodes: Nodes, origin: Any, directions: Sequence[Any], *, active: Sequence[Any] = ()) -> None:
        """Bound `directions` from `origin` [m], all or those that are `active`; t counts from 0 on."""
        # Per axis the quotients by which t is bounded below and above, each with the plane that it is asked about.
        self._near: list[list[tuple[Any, Any]]] = []
        self._far: list[list[tuple[Any, Any]]] = []
        self._turned: list[Any] = []  # where the single ray meets the upper plane first
        if not nodes.host.exact:
            return
        starts = [nodes.point(axis, origin[axis]) for axis in range(3)]
        if len(directions) == 1:
            self._bound_ray(starts, [nodes.vector(axis, directions[0][axis]) for axis in range(3)])
            return
        for axis, start in enumerate(starts):
            low, high = _range([direction[axis] for direction in directions], active)
            low, high = nodes.vector(axis, low), nodes.vector(axis, high)
            low, high = dr.select(abs(low) < TINY, -TINY, low), dr.select(abs(high) < TINY, TINY, high)
            # The lower plane is met by the highest direction, the upper one by the lowest.
            self._near.append(
                [_bounds(high, high > 0, start, otherwise=-HUGE), _bounds(low, low < 0, start, otherwise=-HUGE)]
            )
            self._far.append(
                [_bounds(high, high < 0, start, otherwise=HUGE), _bounds(low, low > 0, start, otherwise=HUGE)]
            )

    def _bound_ray(self, starts: Sequence[Any], directions: Sequence[Any]) -> None:
        """Bound a single ray by one quotient in and one out.

        A component below LEAST is taken as LEAST: the ray enters no later than it would, and leaves earlier only
        beyond t = LEAST^-1 ROUNDINGS u STEPS. Where another component takes it out of the grid before, that is no loss;
        where none does, nothing is bounded.
        """
        reach = reduced(larger, [abs(start) for start in starts]) + STEPS
        bounded = reduced(larger, [abs(direction) for direction in directions]) > reach * SLOWEST
        for start, direction in zip(starts, directions, strict=True):
            least = dr.select(direction < 0, -LEAST, LEAST)
            slope = dr.select(abs(direction) < LEAST, least, direction)
            self._near.append([_bounds(slope, bounded, start, otherwise=-HUGE)])
            self._far.append([_bounds(slope, bounded, start, otherwise=HUGE)])
            self._turned.append(direction < 0)

    def meets(self, box: tuple[list[Any], list[Any]], limit: Any) -> tuple[Any, Any]:
        """Return whether the box is met before t = `limit`, and the t of entry."""
        enters, leaves = [type(limit)(0)], [limit]
        for axis, (near, far) in enumerate(zip(self._near, self._far, strict=True)):
            first, last = box[0][axis], box[1][axis]
            if self._turned:
                turned = self._turned[axis]
                first, last = dr.select(turned, last, first), dr.select(turned, first, last)
            for (scale, offset), plane in zip(near, (first, last), strict=False):
                enters.append(dr.fma(plane, scale, offset))
            for (scale, offset), plane in zip(far, (first, last) if len(far) == 2 else (last,), strict=False):
                leaves.append(dr.fma(plane, scale, offset))
        enter, leave = reduced(larger, enters), reduced(smaller, leaves)
        return ~(enter > leave), enter
