"""Which of the rays from one point may meet a shape at all: those inside the cone about its bounding ball.

Of a lane's rays only the box of their directions is asked, with middle m and half its diagonal h. They lie within
asin(h / norm(m)) of m, and those that meet a ball of half-angle a within a of the unit vector w to its centre. So where
dot(m, w) < cos(a) sqrt(norm(m)^2 - h^2) - sin(a) h no ray meets the ball, and a packet all of whose lanes say so goes
past the shape's formula.

No ray is kept from a shape that it would meet, by a formula that is right. A discriminant such as B^2 - 4 A C is the
difference of numbers as large as the squares of the distances that went into it, so that the square of a ray's distance
from the centre is off by ROUNDINGS u S^2 at most: as much is added to the ball's radius squared. S is all that was
subtracted, times what a matrix adds on the way to object space; ROUNDINGS u S more is what the axis is off. The box is
larger by ROUNDINGS u of its largest coordinate and the cosine smaller by as much, and the products, roots and sums that
are asked round by less than 12 u norm(m). ROUNDINGS is twice and more what any of the formulas has.
"""

import math
import operator
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import drjit as dr
import numpy as np

from rayproof.cases.rounding import UNIT_ROUNDOFF
from rayproof.tracer.acceleration.packet_bounds import larger, reduced, smaller
from rayproof.tracer.kernel.arrays import ArrayTypes
from rayproof.tracer.kernel.parameters import KernelConstants
from rayproof.tracer.shapes.shape import TracedShape

ROUNDINGS = 32.0


class Directions:
    """The box of the directions of each lane's rays, all or those that are active."""

    def __init__(self, directions: Sequence[Any], types: ArrayTypes, *, active: Sequence[Any] | None = None) -> None:
        """Bound `directions`, which are finite. One that is no number bounds nothing, and its ray meets nothing."""
        Float, rounded = types.Float, ROUNDINGS * UNIT_ROUNDOFF[types.precision]

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
    rounded = ROUNDINGS * UNIT_ROUNDOFF[precision]
    subtracted = float(np.linalg.norm(origin) + np.linalg.norm(center) + distance) * shape.magnified
    widest = math.sqrt(radius * radius + rounded * subtracted * subtracted) + rounded * subtracted
    if not widest < distance:
        return None
    sine = widest / distance
    x, y, z = (way / distance).tolist()
    return Cone(axis=(x, y, z), cosine=math.sqrt(1 - sine * sine) * (1 - rounded), sine=sine)
