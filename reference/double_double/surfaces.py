"""Shapes as seen from an exact apex: where rays cross them, what they block of themselves, their normals.

All questions are signs of polynomials in the ray, as exact mathematics would ask them; `questions` keeps their margins.
"""

from dataclasses import dataclass
from fractions import Fraction
from typing import Any, Protocol

import drjit as dr

from cases.scene import Cube, Plane, Sphere, Square
from reference.double_double.constants import Rational, pair, unit
from reference.double_double.constants import dot as exact_dot
from reference.double_double.pairs import Bool, Float, Pair, larger, select, smaller, sqrt
from reference.double_double.placements import placement_of
from reference.double_double.questions import Questions
from reference.double_double.vectors import Matrix, Vector, constant, cross, dot, plus, terms
from reference.double_double.vectors import unit as unit_pairs

FAR = 1e300  # stands for infinity where pairs are compared


@dataclass(frozen=True)
class Span:
    """Crossings count where low < t speed < high; None: 0, no end, 1."""

    low: Pair | None
    high: Pair | None
    speed: Pair | None

    def holds(self, t: Pair, scale: Float, where: Bool, ask: Questions) -> Bool:
        """Return where t counts; `scale` is what t was made of."""
        value = t if self.speed is None else t * self.speed
        scale = scale if self.speed is None else scale * self.speed.size()
        if self.low is None:
            inside = ask.is_positive(value, scale, where)
        else:
            inside = ask.is_less(self.low, value, where, scale + self.low.size())
        if self.high is not None:
            inside &= ask.is_less(value, self.high, where, scale + self.high.size())
        if self.speed is not None:
            inside &= self.speed.is_positive()
        return inside


@dataclass(frozen=True)
class Crossing:
    """The smallest t that counts, where `hit`, and the face's number."""

    t: Pair
    hit: Bool
    face: Any


class Seen(Protocol):
    """A shape seen from an apex; segments start there."""

    is_convex: bool  # and so asked by `blocks_itself` alone what it blocks of itself

    def crossing(
        self, ray: Vector, span: Span, ask: Questions, asked: Bool, without: Any = None, only: Any = None
    ) -> Crossing:
        """Return the first crossing where it is asked for; of a mesh `without` one face, or with one `only`."""
        ...

    def blocks_itself(self, segment: Vector, ask: Questions, where: Bool) -> Bool:
        """Return where a convex shape lies between the apex and its own point at the segment's end."""
        ...

    def normal(self, segment: Vector, face: Any, ask: Questions, where: Bool) -> Vector:
        """Return the unit outward world normal at the segment's end."""
        ...


class SeenSphere:
    """The unit sphere in its own space; the discriminant by Lagrange's identity, a - |start x ray|^2."""

    is_convex = True

    def __init__(self, shape: Sphere, apex: Rational, types: Any) -> None:
        place, self.types = placement_of(shape), types
        start = place.local(apex)
        power = exact_dot(start, start) - 1
        self.to_unit = Matrix(place.inverse, types.Float64)
        self.to_world = Matrix(list(zip(*place.inverse, strict=True)), types.Float64)
        self.start = constant(start, types.Float64)
        self.power = pair(power, types.Float64)
        self.outside = power > 0

    def crossing(
        self, ray: Vector, span: Span, ask: Questions, asked: Bool, without: Any = None, only: Any = None
    ) -> Crossing:
        """Return the first crossing that counts."""
        del without, only
        along = self.to_unit(ray)
        square, half, across = dot(along, along), dot(self.start, along), cross(self.start, along)
        across_square = dot(across, across)
        discriminant = square - across_square
        ask.note(discriminant, square.size() + across_square.size(), asked)
        real = ~discriminant.is_negative() & asked
        root = sqrt(discriminant)
        ahead = half.is_negative()
        # The root that does not cancel, and the other one from their product.
        outer = select(ahead, root - half, -half - root)
        far, near = outer / square, self.power / outer
        first, second = select(ahead, near, far), select(ahead, far, near)
        scale = first.size() + second.size()
        first_counts = span.holds(first, scale, real, ask) & real
        second_counts = span.holds(second, scale, real & ~first_counts, ask) & real
        return Crossing(select(first_counts, first, second), first_counts | second_counts, self.types.Int32(0))

    def blocks_itself(self, segment: Vector, ask: Questions, where: Bool) -> Bool:
        """Return where the point's other root lies between the ends: the sign of h, from an apex outside."""
        if not self.outside:
            return self.types.Bool(False)
        along = self.to_unit(segment)
        point = plus(self.start, along)
        return ask.is_positive(dot(point, along), terms(point, along), where)

    def normal(self, segment: Vector, face: Any, ask: Questions, where: Bool) -> Vector:
        """Return the gradient."""
        del face, ask, where
        return unit_pairs(self.to_world(plus(self.start, self.to_unit(segment))))


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

    def _face(self, segment: Vector, ask: Questions, where: Bool) -> tuple[Any, Bool]:
        """Return the axis of the coordinate of greatest magnitude, x before y before z, and whether it is negative."""
        point = plus(self.start, self.to_local(segment))
        axis, greatest = self.types.Int32(0), point[0]
        for other in (1, 2):
            # |a| > |b| as (a - b)(a + b) > 0.
            above, below = point[other] - greatest, point[other] + greatest
            size = point[other].size() + greatest.size()
            exceeds = ask.is_positive(above * below, size * size, where)
            axis, greatest = dr.select(exceeds, other, axis), select(exceeds, point[other], greatest)
        return axis, greatest.is_negative()

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
