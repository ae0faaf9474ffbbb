"""Planes and squares: z = 0 of their own space."""

from fractions import Fraction
from typing import Any

from rayproof.cases.scene import Plane, Square
from rayproof.reference.double_double.constants import Rational, pair, unit
from rayproof.reference.double_double.pair_arithmetic import Bool
from rayproof.reference.double_double.placements import placement_of
from rayproof.reference.double_double.questions import Questions
from rayproof.reference.double_double.surfaces import Crossing, Span
from rayproof.reference.double_double.vectors import Matrix, Vector, constant, terms


class SeenPlane:
    """The plane z = 0 of object space, or its square."""

    is_convex = True

    def __init__(self, shape: Plane | Square, apex: Rational, types: Any) -> None:
        place, self.types = placement_of(shape), types
        start = place.local(apex)
        self.to_local = Matrix(place.inverse, types.Float64)
        self.start = constant(start, types.Float64)
        self.upward = constant(unit(place.inverse[2]), types.Float64)
        self.bounded = isinstance(shape, Square)
        self.half = pair(Fraction(1, 2), types.Float64)

    def crossing(
        self, ray: Vector, span: Span, ask: Questions, asked: Bool, without: Any = None, only: Any = None
    ) -> Crossing:
        """Return the crossing if it counts."""
        del without, only
        along = self.to_local(ray)
        ask.note(along[2], terms(self.upward, ray), asked)
        t = -self.start[2] / along[2]
        hit = ~along[2].is_zero() & asked
        hit &= span.holds(t, t.size(), hit, ask)
        for axis in (0, 1) if self.bounded else ():
            step = t * along[axis]
            coordinate = self.start[axis] + step
            scale = self.start[axis].size() + step.size() + 0.5
            hit &= ask.is_less(coordinate.absolute(), self.half, hit, scale)
        return Crossing(t, hit, self.types.Int32(0))

    def blocks_itself(self, segment: Vector, ask: Questions, where: Bool) -> Bool:
        """Return false: there is no second root."""
        del segment, ask, where
        return self.types.Bool(False)

    def normal(self, segment: Vector, face: Any, ask: Questions, where: Bool) -> Vector:
        """Return the third row of the inverse."""
        del segment, face, ask, where
        return self.upward
