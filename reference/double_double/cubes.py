"""Cubes and boxes: the cube [-1/2, 1/2]^3 in its own space, by slabs."""

from fractions import Fraction
from typing import Any

import drjit as dr

from rayproof.cases.scene import Cube
from rayproof.reference.double_double.branches import only_where
from rayproof.reference.double_double.constants import Rational, unit
from rayproof.reference.double_double.pair_arithmetic import Bool, Pair, larger, select, smaller
from rayproof.reference.double_double.placements import placement_of
from rayproof.reference.double_double.questions import Questions
from rayproof.reference.double_double.surfaces import Crossing, Span
from rayproof.reference.double_double.vectors import Matrix, Vector, constant, plus

FAR = 1e300  # stands for infinity where pairs are compared


class SeenCube:
    """The cube [-1/2, 1/2]^3 in its own space, by slabs."""

    is_convex = True

    def __init__(self, shape: Cube, apex: Rational, types: Any) -> None:
        place, self.types = placement_of(shape), types
        self.to_local = Matrix(place.inverse, types.Float64)
        self.exact_start = place.local(apex)
        self.start = constant(self.exact_start, types.Float64)
        half = Fraction(1, 2)
        self.lower = constant([-half - value for value in self.exact_start], types.Float64)
        self.upper = constant([half - value for value in self.exact_start], types.Float64)
        self.axes = [constant(unit(row), types.Float64) for row in place.inverse]

    def crossing(
        self, ray: Vector, span: Span, ask: Questions, asked: Bool, without: Any = None, only: Any = None
    ) -> Crossing:
        """Return the first crossing that counts."""
        del without, only
        float64 = self.types.Float64
        enter, leave = Pair(float64(-FAR), float64(0)), Pair(float64(FAR), float64(0))
        missed = ~asked
        for axis, speed in enumerate(self.to_local(ray)):
            parallel, forwards = speed.is_zero(), speed.is_positive()
            down, up = self.lower[axis] / speed, self.upper[axis] / speed
            if abs(self.exact_start[axis]) > Fraction(1, 2):
                missed |= parallel
            enter = select(parallel, enter, larger(enter, select(forwards, down, up)))
            leave = select(parallel, leave, smaller(leave, select(forwards, up, down)))
        scale = enter.size() + leave.size()
        ask.note(leave - enter, scale, ~missed)
        real = ~(leave < enter) & ~missed
        first = span.holds(enter, enter.size(), real, ask) & real
        second = span.holds(leave, leave.size(), real & ~first, ask) & real
        return Crossing(select(first, enter, leave), first | second, self.types.Int32(0))

    def _face(self, segment: Vector, ask: Questions, where: Bool) -> list[Any]:
        """Return the axis of the coordinate of greatest magnitude, x before y before z, and whether it is negative."""

        def work(ask: Questions) -> list[Any]:
            point = plus(self.start, self.to_local(segment))
            axis, greatest = self.types.Int32(0), point[0]
            for other in (1, 2):
                # |a| > |b| as (a - b)(a + b) > 0.
                above, below = point[other] - greatest, point[other] + greatest
                size = point[other].size() + greatest.size()
                exceeds = ask.is_positive(above * below, size * size, where)
                axis, greatest = dr.select(exceeds, other, axis), select(exceeds, point[other], greatest)
            return [axis, greatest.is_negative()]

        return only_where(where, ask, work)

    def blocks_itself(self, segment: Vector, ask: Questions, where: Bool) -> Bool:
        """Return where the apex lies below the point's face and outside the cube, which are exact facts."""
        axis, negative = self._face(segment, ask, where)
        half = Fraction(1, 2)
        answer = self.types.Bool(False)
        if max(abs(value) for value in self.exact_start) <= half:
            return answer
        for number, value in enumerate(self.exact_start):
            below = dr.select(negative, self.types.Bool(-value < half), self.types.Bool(value < half))
            answer |= (axis == number) & below
        return answer

    def normal(self, segment: Vector, face: Any, ask: Questions, where: Bool) -> Vector:
        """Return the inverse's row of the face's axis, with its sign."""
        del face
        axis, negative = self._face(segment, ask, where)
        chosen = [select(axis == 0, x, select(axis == 1, y, z)) for x, y, z in zip(*self.axes, strict=True)]
        x, y, z = (select(negative, -value, value) for value in chosen)
        return (x, y, z)
