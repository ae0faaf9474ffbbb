"""Several rays as one: beams that meet boxes, and cones about shapes.

Several rays from one point, as one beam that is asked which boxes it meets.

For t >= 0 the beam of all directions between `low` and `high` meets the slab between l and h (seen from the origin) if
and only if t high >= l and t low <= h: on an axis whose directions are all positive that is an entry through l and an
exit through h, and where the sign changes two entries and no exit. Which of the four quotients bound t depends on the
signs alone, so that they are chosen once per beam; the others are 0 t -+ HUGE.

No box is missed that exact arithmetic would meet. Grid coordinates and directions are each off by less than 4 u, and
so is a quotient; every bound is moved outward by 16 u (2^16 + abs(origin)) steps over the direction. A comparison with
a NaN counts as met. Source of the aim: Ize, "Robust BVH Ray Traversal", Journal of Computer Graphics Techniques 2
(2013).

Which of the rays from one point may meet a shape at all: those inside the cone about its bounding ball.

Of a lane's rays only the box of their directions is asked, with middle m and half its diagonal h. They lie within
asin(h / norm(m)) of m, and those that meet a ball of half-angle a within a of the unit vector w to its centre. So where
dot(m, w) < cos(a) sqrt(norm(m)^2 - h^2) - sin(a) h no ray meets the ball, and a packet all of whose lanes say so goes
past the shape's formula.

No ray is kept from a shape that it would meet, by a formula that is right. A discriminant such as B^2 - 4 A C is the
difference of numbers as large as the squares of the distances that went into it, so that the square of a ray's distance
from the centre is off by CONE_ROUNDINGS u S^2 at most: as much is added to the ball's radius squared. S is all that was
subtracted, times what a matrix adds on the way to object space; CONE_ROUNDINGS u S more is what the axis is off. The
box is larger by CONE_ROUNDINGS u of its largest coordinate and the cosine smaller by as much, and the products, roots
and sums that are asked round by less than 12 u norm(m). CONE_ROUNDINGS is twice and more what any of the formulas has.
"""

import math
import operator
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import drjit as dr
import numpy as np

from rayproof.cases.rounding import UNIT_ROUNDOFF
from rayproof.tracer.kernel.arithmetic import larger, smaller
from rayproof.tracer.kernel.arrays import ArrayTypes
from rayproof.tracer.kernel.parameters import KernelConstants
from rayproof.tracer.shapes.shape import TracedShape
from rayproof.tracer.trees.boxes import STEPS, Nodes

HUGE = 3e38
TINY = 2.0**-60  # grid steps per unit of t; a narrower beam is widened to it, which misses nothing
# The same for a single ray, and what its largest component must exceed over the distance to go, in steps per t.
LEAST, SLOWEST = 2.0**-100, 2.0**-90
ROUNDINGS = 16.0


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
    """The properties that the rays of each lane share; a single ray also knows which plane it meets first."""

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


CONE_ROUNDINGS = 32.0


class Directions:
    """The box of the directions of each lane's rays, all or those that are active."""

    def __init__(self, directions: Sequence[Any], types: ArrayTypes, *, active: Sequence[Any] | None = None) -> None:
        """Bound `directions`, which are finite. One that is no number bounds nothing, and its ray meets nothing."""
        Float, rounded = types.Float, CONE_ROUNDINGS * UNIT_ROUNDOFF[types.precision]

        if active is not None:
            # Those that are not take the direction of the first that is.
            first = directions[0]
            for one, counts in zip(directions[::-1], active[::-1], strict=True):
                first = dr.select(counts, one, first)
            directions = [dr.select(counts, one, first) for one, counts in zip(directions, active, strict=True)]
        middle, half = [], []
        for axis in range(3):
            low, high = Float(dr.inf), Float(-dr.inf)
            for direction in directions:
                low, high = smaller(direction[axis], low), larger(direction[axis], high)
            middle.append((low + high) * 0.5)
            half.append((high - low) * 0.5 + larger(abs(low), abs(high)) * rounded)
        self.middle = types.Vector(*middle)
        if active is not None:
            self.middle = dr.select(reduced(operator.or_, active), self.middle, dr.nan)  # nobody meets anything
        across = dr.squared_norm(types.Vector(*half))
        along = dr.squared_norm(self.middle) - across
        self.along = dr.sqrt(larger(along, 0))
        # A box about the point itself holds all directions.
        self.across = dr.select(along > 0, dr.sqrt(across), dr.inf)

    @property
    def arrays(self) -> tuple[Any, ...]:
        """Return all that a cone is compared with."""
        return self.middle, self.along, self.across


@dataclass(frozen=True, kw_only=True)
class Cone:
    """A shape's bounding ball as it is seen from a point."""

    axis: tuple[float, float, float]  # unit vector from the point to the centre
    cosine: float  # of the half-angle
    sine: float

    def may_meet(self, rays: Directions, types: ArrayTypes, parameters: KernelConstants, *, name: str) -> Any:
        """Return in which lanes a ray from the point may meet the ball."""
        axis = parameters(f"{name} axis", types.Vector(*self.axis))
        cosine, sine = (parameters(f"{name} {of}", types.Float(getattr(self, of))) for of in ("cosine", "sine"))
        return dr.dot(rays.middle, axis) >= cosine * rays.along - sine * rays.across

    @property
    def reversed(self) -> "Cone":
        """Return the cone of the directions that lead back to the point."""
        x, y, z = self.axis
        return Cone(axis=(-x, -y, -z), cosine=self.cosine, sine=self.sine)


def cone(shape: TracedShape, origin: Sequence[float], precision: str) -> Cone | None:
    """Return the cone about a shape as seen from `origin` [m]; None where it has half of all directions or more."""
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
