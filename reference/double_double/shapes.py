"""Rays against cube, sphere and triangles in pairs: crossings, what a shape blocks of itself, normals.

All questions are signs of polynomials in the ray, as exact mathematics would ask them; `questions` keeps their margins.
"""

from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import Any, Protocol

import drjit as dr
import numpy as np

from rayproof.cases.placement import world_triangles
from rayproof.cases.scene import Cube, Mesh, Sphere, Triangle
from rayproof.reference.double_double.arithmetic import (
    LOW_MARGIN,
    Bool,
    Float,
    Pair,
    Questions,
    Rational,
    fractions,
    larger,
    minus,
    only_where,
    pair,
    parts,
    select,
    smaller,
    sqrt,
    unit,
)
from rayproof.reference.double_double.arithmetic import cross as exact_cross
from rayproof.reference.double_double.arithmetic import dot as exact_dot
from rayproof.reference.double_double.vectors import (
    ConstantMatrix,
    Vector,
    constant,
    pair_cross,
    pair_dot,
    placement_of,
    plus,
    terms,
)
from rayproof.reference.double_double.vectors import unit as unit_of_pairs


@dataclass(frozen=True)
class PairSpan:
    """Crossings count where low < t speed < high; None: 0, no end, 1."""

    low: Pair | None
    high: Pair | None
    speed: Pair | None

    @property
    def is_shadow_ray(self) -> bool:
        """Return whether crossings count between a ray's ends alone, t = 0 and 1."""
        return self.low is None and self.high is not None

    def holds(self, t: Pair, scale: Float, where: Bool, ask: Questions) -> Bool:
        """Return where t counts; `scale` is what t was made of."""
        value = t if self.speed is None else t * self.speed
        scale = scale if self.speed is None else scale * self.speed.size()
        if self.low is None:
            inside = ask.is_positive(value, scale, where)
        else:
            inside = ask.is_less(self.low, value, where, scale + self.low.size())
        if self.high is not None:
            whole = scale + self.high.size()
            inside &= ask.is_less(value, self.high, where, whole)
            if self.is_shadow_ray:
                # The end lies on the surface that was hit, and on whatever coincides with it: neither lies before it.
                inside &= (self.high - value).size() > LOW_MARGIN * whole
        if self.speed is not None:
            inside &= self.speed.is_positive()
        return inside


@dataclass(frozen=True)
class PairCrossing:
    """The smallest t that counts, where `hit`, and the face's number."""

    t: Pair
    hit: Bool
    face: Any


class Seen(Protocol):
    """A shape seen from an apex; segments start there."""

    is_convex: bool  # and so asked by `blocks_itself` alone what it blocks of itself

    def crossing(
        self, ray: Vector, span: PairSpan, ask: Questions, asked: Bool, without: Any = None, only: Any = None
    ) -> PairCrossing:
        """Return the first crossing where it is asked for; of a mesh `without` one face, or with one `only`."""
        ...

    def blocks_itself(self, segment: Vector, ask: Questions, where: Bool) -> Bool:
        """Return where a convex shape lies between the apex and its own point at the segment's end."""
        ...

    def normal(self, segment: Vector, face: Any, ask: Questions, where: Bool) -> Vector:
        """Return the unit outward world normal at the segment's end."""
        ...


# Cubes and boxes: the cube [-1/2, 1/2]^3 in its own space, by slabs.


FAR = 1e300  # stands for infinity where pairs are compared


class PairCube:
    """The cube [-1/2, 1/2]^3 in its own space, by slabs."""

    is_convex = True

    def __init__(self, shape: Cube, apex: Rational, types: Any) -> None:
        place, self.types = placement_of(shape), types
        self.to_local = ConstantMatrix(place.inverse, types.Float64)
        self.exact_start = place.local(apex)
        self.start = constant(self.exact_start, types.Float64)
        half = Fraction(1, 2)
        self.lower = constant([-half - value for value in self.exact_start], types.Float64)
        self.upper = constant([half - value for value in self.exact_start], types.Float64)
        self.axes = [constant(unit(row), types.Float64) for row in place.inverse]

    def crossing(
        self, ray: Vector, span: PairSpan, ask: Questions, asked: Bool, without: Any = None, only: Any = None
    ) -> PairCrossing:
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
        return PairCrossing(select(first, enter, leave), first | second, self.types.Int32(0))

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


# Spheres and ellipsoids: the unit sphere in its own space.


class PairSphere:
    """The unit sphere in its own space; the discriminant by Lagrange's identity, a - |start x ray|^2."""

    is_convex = True

    def __init__(self, shape: Sphere, apex: Rational, types: Any) -> None:
        place, self.types = placement_of(shape), types
        start = place.local(apex)
        power = exact_dot(start, start) - 1
        self.to_unit = ConstantMatrix(place.inverse, types.Float64)
        self.to_world = ConstantMatrix(list(zip(*place.inverse, strict=True)), types.Float64)
        self.start = constant(start, types.Float64)
        self.power = pair(power, types.Float64)
        self.outside = power > 0

    def crossing(
        self, ray: Vector, span: PairSpan, ask: Questions, asked: Bool, without: Any = None, only: Any = None
    ) -> PairCrossing:
        """Return the first crossing that counts."""
        del without, only
        along = self.to_unit(ray)
        square, half, across = pair_dot(along, along), pair_dot(self.start, along), pair_cross(self.start, along)
        across_square = pair_dot(across, across)
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
        return PairCrossing(select(first_counts, first, second), first_counts | second_counts, self.types.Int32(0))

    def blocks_itself(self, segment: Vector, ask: Questions, where: Bool) -> Bool:
        """Return where the point's other root lies between the ends: the sign of h, from an apex outside."""
        if not self.outside:
            return self.types.Bool(False)

        def work(ask: Questions) -> list[Bool]:
            along = self.to_unit(segment)
            point = plus(self.start, along)
            return [ask.is_positive(pair_dot(point, along), terms(point, along), where)]

        return only_where(where, ask, work)[0]

    def normal(self, segment: Vector, face: Any, ask: Questions, where: Bool) -> Vector:
        """Return the gradient."""
        del face
        x, y, z = only_where(
            where, ask, lambda _: unit_of_pairs(self.to_world(plus(self.start, self.to_unit(segment))))
        )
        return (x, y, z)


# Triangles and meshes, face by face in a loop: signs of u, v and the rest by Cramer's rule (HIT-6).


# Of each face: determinant, u and v as vectors to be multiplied by the ray (9 numbers), and the height over it.
COLUMNS = 10


class SeenTriangles:
    """The faces of a triangle or mesh; those without area are left out and their numbers kept."""

    is_convex = False

    def __init__(self, shape: Triangle | Mesh, apex: Rational, types: Any) -> None:
        self.types = types
        table = _faces(shape, apex)
        self.count = len(table.numbers)
        self.high = [types.Float64(column) for column in table.high.T]
        self.low = [types.Float64(column) for column in table.low.T]
        self.numbers = types.Int32(table.numbers)
        normals = _normals(shape)
        self.normal_high = [types.Float64(column) for column in normals[0].T]
        self.normal_low = [types.Float64(column) for column in normals[1].T]

    def crossing(
        self, ray: Vector, span: PairSpan, ask: Questions, asked: Bool, without: Any = None, only: Any = None
    ) -> PairCrossing:
        """Return the first crossing that counts, `without` a face or with one `only`; of equal ones the first."""
        types = self.types
        width = dr.width(ray[0].high)
        start = (
            types.UInt32(0), dr.full(types.Float64, np.inf, width), dr.zeros(types.Float64, width),
            dr.full(types.Int32, -1, width), dr.full(types.Float64, np.inf, width),
        )  # fmt: skip

        if self.count == 0:  # all without area: there is nothing to gather from
            return PairCrossing(Pair(start[1], start[2]), start[3] >= 0, start[3])

        def step(index: Any, high: Any, low: Any, face: Any, least: Any) -> tuple[Any, ...]:
            inner = Questions(types.Float64)
            found, number = self._one(index, ray, span, inner, asked, without, only)
            best = Pair(high, low)
            both = found.hit & (face >= 0)
            nearer = found.hit & ((face < 0) | inner.is_less(found.t, best, both))
            best = select(nearer, found.t, best)
            margin = dr.select(inner.least < least, inner.least, least)
            return index + 1, best.high, best.low, dr.select(nearer, number, face), margin

        _, high, low, face, least = dr.while_loop(start, lambda index, *_: index < self.count, step)
        ask.least = dr.select(least < ask.least, least, ask.least)
        return PairCrossing(Pair(high, low), face >= 0, face)

    def _one(
        self, index: Any, ray: Vector, span: PairSpan, ask: Questions, asked: Bool, without: Any, only: Any
    ) -> tuple[PairCrossing, Any]:
        types = self.types
        columns = [
            Pair(dr.gather(types.Float64, high, index), dr.gather(types.Float64, low, index))
            for high, low in zip(self.high, self.low, strict=True)
        ]
        number = dr.gather(types.Int32, self.numbers, index)
        by_determinant, by_u, by_v = ((columns[at], columns[at + 1], columns[at + 2]) for at in (0, 3, 6))
        if without is not None:
            asked = asked & (number != without)
        if only is not None:
            asked = asked & (number == only)
        determinant, u, v = pair_dot(by_determinant, ray), pair_dot(by_u, ray), pair_dot(by_v, ray)
        scales = [terms(by_determinant, ray), terms(by_u, ray), terms(by_v, ray)]
        ask.note(determinant, scales[0], asked)
        hit = asked & ~determinant.is_zero()
        backwards = determinant.is_negative()
        for value, scale in ((u, scales[1]), (v, scales[2]), (determinant - u - v, scales[0] + scales[1] + scales[2])):
            ask.note(value, scale, hit)
            hit &= dr.select(backwards, ~value.is_positive(), ~value.is_negative())
        t = columns[9] / determinant
        hit &= span.holds(t, t.size(), hit, ask)
        return PairCrossing(t, hit, number), number

    def blocks_itself(self, segment: Vector, ask: Questions, where: Bool) -> Bool:
        """Return false: a face has no second root, and the others are asked as blockers."""
        del segment, ask, where
        return self.types.Bool(False)

    def normal(self, segment: Vector, face: Any, ask: Questions, where: Bool) -> Vector:
        """Return the face's normal by its winding in object space, under the inverse transpose."""
        del segment, ask
        index = self.types.UInt32(dr.select(where & (face >= 0), face, 0))
        x, y, z = (
            Pair(dr.gather(self.types.Float64, high, index), dr.gather(self.types.Float64, low, index))
            for high, low in zip(self.normal_high, self.normal_low, strict=True)
        )
        return (x, y, z)


class FaceTable:
    """Constants of the faces that have an area, (faces, COLUMNS) in high and low parts."""

    def __init__(self, numbers: list[int], rows: list[list[Fraction]]) -> None:
        split = np.array([[parts(value) for value in row] for row in rows], dtype=np.float64)
        split = split.reshape(len(rows), COLUMNS, 2)
        self.numbers = np.array(numbers, dtype=np.int32)
        self.high, self.low = split[..., 0], split[..., 1]


@lru_cache(maxsize=64)
def _faces(shape: Triangle | Mesh, apex: Rational) -> FaceTable:
    numbers, rows = [], []
    windings = _windings(shape)
    for number, corners in enumerate(world_triangles(shape).tolist()):
        first, second, third = (fractions(corner) for corner in corners)
        one, two, to_apex = minus(second, first), minus(third, first), minus(apex, first)
        by_determinant, across = exact_cross(two, one), exact_cross(to_apex, one)
        if any(by_determinant) and any(windings[number]):
            numbers.append(number)
            rows.append([*by_determinant, *exact_cross(two, to_apex), *across, exact_dot(across, two)])
    return FaceTable(numbers, rows)


@lru_cache(maxsize=64)
def _windings(shape: Triangle | Mesh) -> list[Rational]:
    if isinstance(shape, Triangle):
        faces = [[fractions(vertex) for vertex in shape.vertices]]
    else:
        vertices = [fractions(vertex) for vertex in shape.vertices.tolist()]
        faces = [[vertices[index] for index in face] for face in shape.faces.tolist()]
    return [exact_cross(minus(b, a), minus(c, a)) for a, b, c in faces]


@lru_cache(maxsize=64)
def _normals(shape: Triangle | Mesh) -> tuple[np.ndarray, np.ndarray]:
    columns = list(zip(*placement_of(shape).inverse, strict=True))
    normals = [unit(tuple(exact_dot(column, winding) for column in columns)) for winding in _windings(shape)]  # pyright: ignore[reportArgumentType]
    rows = [[parts(value) for value in normal] for normal in normals]
    split = np.array(rows, dtype=np.float64)
    return np.ascontiguousarray(split[..., 0]), np.ascontiguousarray(split[..., 1])
