"""Triangles and meshes, face by face in a loop: signs of u, v and the rest by Cramer's rule (HIT-6)."""

from fractions import Fraction
from functools import lru_cache
from typing import Any

import drjit as dr
import numpy as np

from rayproof.cases.placement import world_triangles
from rayproof.cases.scene import Mesh, Triangle
from rayproof.reference.double_double.constants import Rational, cross, dot, fractions, minus, parts, unit
from rayproof.reference.double_double.pair_arithmetic import Bool, Pair, select
from rayproof.reference.double_double.placements import placement_of
from rayproof.reference.double_double.questions import Questions
from rayproof.reference.double_double.surfaces import Crossing, Span
from rayproof.reference.double_double.vectors import Vector, terms
from rayproof.reference.double_double.vectors import dot as pair_dot

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
        self, ray: Vector, span: Span, ask: Questions, asked: Bool, without: Any = None, only: Any = None
    ) -> Crossing:
        """Return the first crossing that counts, `without` a face or with one `only`; of equal ones the first."""
        types = self.types
        width = dr.width(ray[0].high)
        start = (
            types.UInt32(0), dr.full(types.Float64, np.inf, width), dr.zeros(types.Float64, width),
            dr.full(types.Int32, -1, width), dr.full(types.Float64, np.inf, width),
        )  # fmt: skip

        if self.count == 0:  # all without area: there is nothing to gather from
            return Crossing(Pair(start[1], start[2]), start[3] >= 0, start[3])

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
        return Crossing(Pair(high, low), face >= 0, face)

    def _one(
        self, index: Any, ray: Vector, span: Span, ask: Questions, asked: Bool, without: Any, only: Any
    ) -> tuple[Crossing, Any]:
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
        return Crossing(t, hit, number), number

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


class Table:
    """Constants of the faces that have an area, (faces, COLUMNS) in high and low parts."""

    def __init__(self, numbers: list[int], rows: list[list[Fraction]]) -> None:
        split = np.array([[parts(value) for value in row] for row in rows], dtype=np.float64)
        split = split.reshape(len(rows), COLUMNS, 2)
        self.numbers = np.array(numbers, dtype=np.int32)
        self.high, self.low = split[..., 0], split[..., 1]


@lru_cache(maxsize=64)
def _faces(shape: Triangle | Mesh, apex: Rational) -> Table:
    numbers, rows = [], []
    windings = _windings(shape)
    for number, corners in enumerate(world_triangles(shape).tolist()):
        first, second, third = (fractions(corner) for corner in corners)
        one, two, to_apex = minus(second, first), minus(third, first), minus(apex, first)
        by_determinant, across = cross(two, one), cross(to_apex, one)
        if any(by_determinant) and any(windings[number]):
            numbers.append(number)
            rows.append([*by_determinant, *cross(two, to_apex), *across, dot(across, two)])
    return Table(numbers, rows)


@lru_cache(maxsize=64)
def _windings(shape: Triangle | Mesh) -> list[Rational]:
    if isinstance(shape, Triangle):
        faces = [[fractions(vertex) for vertex in shape.vertices]]
    else:
        vertices = [fractions(vertex) for vertex in shape.vertices.tolist()]
        faces = [[vertices[index] for index in face] for face in shape.faces.tolist()]
    return [cross(minus(b, a), minus(c, a)) for a, b, c in faces]


@lru_cache(maxsize=64)
def _normals(shape: Triangle | Mesh) -> tuple[np.ndarray, np.ndarray]:
    columns = list(zip(*placement_of(shape).inverse, strict=True))
    normals = [unit(tuple(dot(column, winding) for column in columns)) for winding in _windings(shape)]  # pyright: ignore[reportArgumentType]
    rows = [[parts(value) for value in normal] for normal in normals]
    split = np.array(rows, dtype=np.float64)
    return np.ascontiguousarray(split[..., 0]), np.ascontiguousarray(split[..., 1])
