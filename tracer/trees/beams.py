"""`Beam`, the box test of several rays from one point at once, and `Cone`, the cone about a shape.

For t >= 0 the beam of all directions between `low` and `high` meets the slab between l and h (seen from the origin) if
and only if t high >= l and t low <= h: on an axis whose directions are all positive that is an entry through l and an
exit through h, and if the sign changes, two entries and no exit. The order of the planes depends only on the signs and
is determined once per beam; a quotient that bounds nothing is 0 x -+ HUGE.

No box is missed that exact arithmetic would hit. Grid coordinates and directions each have an error of less than 4 u, a
quotient one of 5 u, and t at a plane has two more roundings, since a node's corner is added first and then the offset
within; every bound is moved outward by 16 u (2^16 + abs(origin)) steps over the direction. A comparison with a NaN
counts as a hit. Source of the goal: Ize, "Robust BVH Ray Traversal", Journal of Computer Graphics Techniques 2 (2013).

The rays from one point that may hit a shape are those inside the cone about its bounding ball.

The test uses only the box of the directions of a lane's rays, with middle m and half diagonal h. The directions are
within asin(h / norm(m)) of m, and rays that hit a ball of half-angle a are within a of the unit vector w to its centre.
So if dot(m, w) < cos(a) sqrt(norm(m)^2 - h^2) - sin(a) h, no ray hits the ball, and a packet skips the shape's formula
if this holds in all of its lanes.

No ray is culled that would hit the shape by a right formula. A discriminant such as B^2 - 4 A C is the difference of
numbers as large as the squares of the distances from which it is computed, so that the error of a ray's squared
distance from the centre is at most CONE_ROUNDINGS u S^2: as much is added to the ball's squared radius. S is the sum of
the subtracted coordinates, times the amplification by a matrix into object space; the error of the axis is
CONE_ROUNDINGS u S more. The box is larger by CONE_ROUNDINGS u of its largest coordinate and the cosine smaller by as
much, and the products, roots and sums of the test have errors of less than 12 u norm(m). CONE_ROUNDINGS is at least
twice the number of roundings of any of the formulas.
"""

import math
import operator
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import drjit as dr
import numpy as np

from rayproof.cases.rounding import UNIT_ROUNDOFF
from rayproof.tracer.kernel.arithmetic import larger, smaller
from rayproof.tracer.kernel.arrays import ArrayTypes
from rayproof.tracer.kernel.parameters import KernelConstants
from rayproof.tracer.shapes.shape import TracedShape
from rayproof.tracer.trees.boxes import AXES, CHILDREN, STEPS, Nodes, places, unpacked

HUGE = 3e38  # almost the largest number of float32, 3.4e38
TINY = 2.0**-60  # grid steps per unit of t; a narrower beam is widened to it, which misses nothing
# The same for a single ray, and the least allowed ratio of its largest component to the remaining distance, in steps
# per t.
LEAST, SLOWEST = 2.0**-100, 2.0**-90
ROUNDINGS = 16.0


def _bounds(slope: Any, applies: Any, origin: Any, *, entry: Any) -> tuple[Any, Any]:
    """Return scale and offset of (x - origin) / slope, moved outward; 0 and -HUGE or HUGE where it bounds nothing."""
    Single, scale = type(slope), 1 / slope
    margin = abs(scale) * (abs(origin) + STEPS) * (ROUNDINGS * UNIT_ROUNDOFF["float32"])
    offset = -origin * scale + dr.select(entry, -margin, margin)
    return dr.select(applies, scale, 0), dr.select(applies, offset, dr.select(entry, Single(-HUGE), HUGE))


def _range(components: Sequence[Any], active: Sequence[Any]) -> tuple[Any, Any]:
    """Return the smallest and the largest component of all or of the active rays; an empty range if there are none."""
    low, high = type(components[0])(dr.inf), type(components[0])(-dr.inf)
    for component, counts in zip(components, active or [True] * len(components), strict=True):
        low = dr.select(counts & (component < low), component, low)
        high = dr.select(counts & (component > high), component, high)
    return low, high


def reduced(choose: Callable[[Any, Any], Any], values: Sequence[Any]) -> Any:
    """Return the smallest or the largest of the values by a balanced tree of comparisons, which can run in parallel."""
    while len(values) > 1:
        pairs = [choose(*values[k : k + 2]) for k in range(0, len(values) - 1, 2)]
        values = [*pairs, *values[len(values) - len(values) % 2 :]]
    return values[0]


@dataclass(frozen=True, kw_only=True)
class _Slab:
    """The common test of each lane's rays along an axis: at a plane x, in grid steps, t is scale x + offset."""

    turned: Any  # mask: all rays go down, and meet a box's upper plane first
    both: Any  # mask: some rays go up and some down, so that the last plane is an entry too; None for a single ray
    first: tuple[Any, Any]  # scale and offset for the first plane
    last: tuple[Any, Any]

    def planes(self, lower: Any, upper: Any, corner: Any, scale: Any) -> Iterator[list[Any]]:
        """Yield t at the first planes of a node's children, then at their last ones."""
        words = dr.select(self.turned, upper, lower), dr.select(self.turned, lower, upper)
        for word, (slope, offset) in zip(words, (self.first, self.last), strict=True):
            yield [dr.fma(place, slope * scale, dr.fma(corner, slope, offset)) for place in places(word)]

    def within(self, enter: Any, leave: Any, last: Any) -> tuple[Any, Any]:
        """Return entry and exit bounded by t at the last plane."""
        if self.both is None:
            return enter, smaller(last, leave)
        return dr.select(self.both, larger(last, enter), enter), dr.select(self.both, leave, smaller(last, leave))


class Beam:
    """The properties that the rays of each lane share."""

    def __init__(self, nodes: Nodes, origin: Any, directions: Sequence[Any], *, active: Sequence[Any] = ()) -> None:
        """Bound `directions` from `origin` [m], all or the `active` ones, for t >= 0."""
        self._slabs: list[_Slab] = []
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
            # The highest direction meets the lower plane first, the lowest direction the upper plane.
            turned = high < 0
            both_signs = ~turned & (low < 0)
            first = _bounds(dr.select(turned, low, high), turned | (high > 0), start, entry=True)
            last = _bounds(dr.select(turned, high, low), turned | both_signs | (low > 0), start, entry=both_signs)
            self._slabs.append(_Slab(turned=turned, both=both_signs, first=first, last=last))

    def _bound_ray(self, starts: Sequence[Any], directions: Sequence[Any]) -> None:
        """Bound a single ray by one quotient for its entry and one for its exit.

        A component below LEAST is replaced by LEAST: the ray enters no later than it would, and leaves earlier only
        beyond t = LEAST^-1 ROUNDINGS u STEPS. If another component takes the ray out of the grid before, no box is
        missed; if there is no such component, nothing is bounded.
        """
        reach = reduced(larger, [abs(start) for start in starts]) + STEPS
        bounded = reduced(larger, [abs(direction) for direction in directions]) > reach * SLOWEST
        for start, direction in zip(starts, directions, strict=True):
            least = dr.select(direction < 0, -LEAST, LEAST)
            slope = dr.select(abs(direction) < LEAST, least, direction)
            first, last = (_bounds(slope, bounded, start, entry=entry) for entry in (True, False))
            self._slabs.append(_Slab(turned=direction < 0, both=None, first=first, last=last))

    def meets(self, words: Sequence[Any], limit: Any) -> list[tuple[Any, Any]]:
        """Return whether each child of a node, by its words, is hit before t = `limit`, and the t of entry."""
        coordinates, corner, scale = unpacked(words)
        parts = zip(self._slabs, coordinates[:AXES], coordinates[AXES:], corner, scale, strict=False)
        planes = [tuple(slab.planes(*part)) for slab, *part in parts]
        entries = []
        for child in range(CHILDREN):
            enter = reduced(larger, [type(limit)(0), *(first[child] for first, _ in planes)])
            leave = limit
            for slab, (_, last) in zip(self._slabs, planes, strict=True):
                enter, leave = slab.within(enter, leave, last[child])
            entries.append((~(enter > leave), enter))
        return entries


CONE_ROUNDINGS = 32.0


class Directions:
    """The box of the directions of each lane's rays, all or only the active ones."""

    def __init__(self, directions: Sequence[Any], types: ArrayTypes, *, active: Sequence[Any] | None = None) -> None:
        """Bound `directions`, which are finite. A NaN direction bounds nothing, and its ray hits nothing."""
        Float, rounded = types.Float, CONE_ROUNDINGS * UNIT_ROUNDOFF[types.precision]

        if active is not None:
            # Inactive rays take the direction of the first active ray.
            first = directions[0]
            for vector, counts in zip(directions[::-1], active[::-1], strict=True):
                first = dr.select(counts, vector, first)
            directions = [dr.select(counts, vector, first) for vector, counts in zip(directions, active, strict=True)]
        middle, half = [], []
        for axis in range(3):
            low, high = Float(dr.inf), Float(-dr.inf)
            for direction in directions:
                low, high = smaller(direction[axis], low), larger(direction[axis], high)
            middle.append((low + high) * 0.5)
            half.append((high - low) * 0.5 + larger(abs(low), abs(high)) * rounded)
        self.middle = types.Vector(*middle)
        if active is not None:
            self.middle = dr.select(
                reduced(operator.or_, active), self.middle, dr.nan
            )  # without active rays nothing is hit
        across = dr.squared_norm(types.Vector(*half))
        along = dr.squared_norm(self.middle) - across
        self.along = dr.sqrt(larger(along, 0))
        # A box about the point itself holds all directions.
        self.across = dr.select(along > 0, dr.sqrt(across), dr.inf)

    @property
    def arrays(self) -> tuple[Any, ...]:
        """Return the arrays that a cone is compared with."""
        return self.middle, self.along, self.across


@dataclass(frozen=True, kw_only=True)
class Cone:
    """The cone from a point about a shape's bounding ball."""

    axis: tuple[float, float, float]  # unit vector from the point to the centre
    cosine: float  # of the half-angle
    sine: float

    def may_meet(self, rays: Directions, types: ArrayTypes, parameters: KernelConstants, *, name: str) -> Any:
        """Return the mask of lanes with a ray from the point that may hit the ball."""
        axis = parameters(f"{name} axis", types.Vector(*self.axis))
        cosine, sine = (parameters(f"{name} {of}", types.Float(getattr(self, of))) for of in ("cosine", "sine"))
        return dr.dot(rays.middle, axis) >= cosine * rays.along - sine * rays.across

    @property
    def reversed(self) -> "Cone":
        """Return the cone of the directions that lead back to the point."""
        x, y, z = self.axis
        return Cone(axis=(-x, -y, -z), cosine=self.cosine, sine=self.sine)


def cone(shape: TracedShape, origin: Sequence[float], precision: str) -> Cone | None:
    """Return the cone about a shape as seen from `origin` [m]; None if it contains at least half of all directions."""
    if shape.ball is None:
        return None
    center, radius = shape.ball
    way = center - np.asarray(origin, dtype=np.float64)
    distance = float(np.linalg.norm(way))
    rounded = CONE_ROUNDINGS * UNIT_ROUNDOFF[precision]
    subtracted = float(np.linalg.norm(origin) + np.linalg.norm(center) + distance) * shape.magnified
    widest = math.sqrt(radius * radius + rounded * subtracted * subtracted) + rounded * subtracted
    if not widest < distance:
        return None
    sine = widest / distance
    x, y, z = (way / distance).tolist()
    return Cone(axis=(x, y, z), cosine=math.sqrt(1 - sine * sine) * (1 - rounded), sine=sine)
