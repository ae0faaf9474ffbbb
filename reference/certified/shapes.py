"""Shapes as exact rationals: placement by inverse matrix, and cube, plane, triangle and sphere seen from a point."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import product

from flint import fmpq

from rayproof.cases.placement import world_triangles
from rayproof.cases.scene import Cube, Mesh, Shape, Sphere, Square, Triangle
from rayproof.reference.certified.fields import Number, NumberField, Vector, exact
from rayproof.reference.certified.numbers import Rational, RowVector, Window, applied, cross, dot, minus, numbers, rows

Square3 = tuple[Rational, Rational, Rational]


@dataclass(frozen=True, kw_only=True)
class Placement:
    """The affine map world point = linear times object point + offset, and its inverse."""

    linear: Square3
    offset: Rational  # m
    inverse: Square3

    def local(self, point: Rational) -> Rational:
        """Return a world point [m] in object space."""
        moved = minus(point, self.offset)
        return rational(dot(row, moved) for row in self.inverse)


def rational(values: object) -> Rational:
    """Return three floats or rationals as exact rationals."""
    x, y, z = (value if isinstance(value, fmpq) else exact(value) for value in values)  # pyright: ignore[reportGeneralTypeIssues]
    return (x, y, z)


def transposed(matrix: Sequence[Sequence[fmpq]]) -> Square3:
    """Return the transposed 3x3 matrix."""
    x, y, z = (rational(row[axis] for row in matrix) for axis in range(3))
    return (x, y, z)


@lru_cache(maxsize=256)
def placement_of(shape: Shape) -> Placement:
    """Return the exact placement of a shape, inverted by cofactors; a sphere's maps onto the unit sphere."""
    matrix = shape.to_world
    linear = (rational(matrix[0][:3]), rational(matrix[1][:3]), rational(matrix[2][:3]))
    offset = rational(row[3] for row in matrix[:3])
    if isinstance(shape, Sphere):
        center, radius = rational(shape.center), exact(shape.radius)
        offset = rational(dot(row, center) + move for row, move in zip(linear, offset, strict=True))
        x, y, z = (rational(value * radius for value in row) for row in linear)
        linear = (x, y, z)
    x, y, z = transposed(linear)
    cofactors = (cross(y, z), cross(z, x), cross(x, y))
    determinant = dot(x, cofactors[0])
    first, second, third = (rational(value / determinant for value in row) for row in cofactors)
    return Placement(linear=linear, offset=offset, inverse=(first, second, third))


@lru_cache(maxsize=4096)
def corners_of(shape: Triangle | Mesh, face: int) -> Square3:
    """Return the world-space corners [m] of a triangle, rounded to float32 as every renderer gets them."""
    first, second, third = (rational(corner) for corner in world_triangles(shape)[face].tolist())
    return (first, second, third)


@lru_cache(maxsize=4096)
def winding_of(shape: Triangle | Mesh, face: int) -> Rational:
    """Return the object-space normal by winding, of any length; zero for a triangle without area."""
    if isinstance(shape, Triangle):
        corners = [rational(vertex) for vertex in shape.vertices]
    else:
        corners = [rational(vertex) for vertex in shape.vertices[shape.faces[face]].tolist()]
    return cross(minus(corners[1], corners[0]), minus(corners[2], corners[0]))


def faces_of(shape: Shape) -> range:
    """Return the face numbers of a shape; all but meshes have one."""
    return range(len(shape.faces)) if isinstance(shape, Mesh) else range(1)


# Cubes under any affine map, seen from a rational apex, by slabs.
#
# The largest entering and the smallest leaving distance are operations on balls, without a comparison of slabs. Only
# the comparisons of these two distances are decisions (HIT-3).


Branch = tuple[bool, tuple[int, int, int]]  # whether the ray enters here, and the signs of its direction


class SeenCube:
    """The cube [-1/2, 1/2]^3 in its own space."""

    def __init__(self, field: NumberField, shape: Cube, apex: Rational) -> None:
        place = placement_of(shape)
        self.field = field
        self.exact_start = place.local(apex)
        self.start = numbers(field, self.exact_start)
        self.to_local = rows(field, place.inverse)
        self.outside = max(abs(value) for value in self.exact_start) > fmpq(1, 2)
        half = fmpq(1, 2)
        # Per axis the distance to the face of the slab that a ray of this sign enters, times its speed.
        self.entering = {
            (axis, sign): field.number(-sign * half - self.exact_start[axis])
            for axis, sign in product(range(3), (-1, 1))
        }
        self.normals = {
            (axis, sign): numbers(field, [sign * value for value in place.inverse[axis]])
            for axis, sign in product(range(3), (-1, 1))
        }

    def crossing(self, direction: Vector, window: Window) -> tuple[Number, Branch] | None:
        """Return the smallest t in the window and its branch, or None; raise UndecidedError."""
        speeds = applied(self.to_local, direction)
        signs = tuple(self.field.sign(speed) for speed in speeds)
        for sign, start in zip(signs, self.exact_start, strict=True):
            if sign == 0 and abs(start) > fmpq(1, 2):
                return None
        enter, leave = self._ends(speeds, signs)
        if self.field.sign(leave - enter) < 0:
            return None
        if enter in window:
            return enter, (True, signs)  # pyright: ignore[reportReturnType]
        return (leave, (False, signs)) if leave in window else None  # pyright: ignore[reportReturnType]

    def at(self, direction: Vector, branch: Branch) -> Number:
        """Return t where the ray is known to hit."""
        entering, signs = branch
        enter, leave = self._ends(applied(self.to_local, direction), signs)
        return enter if entering else leave

    def _ends(self, speeds: Vector, signs: tuple[int, ...]) -> tuple[Number, Number]:
        moving = [axis for axis in range(3) if signs[axis]]
        enter = self.field.largest([self.entering[axis, signs[axis]] / speeds[axis] for axis in moving])
        leave = self.field.smallest([self.entering[axis, -signs[axis]] / speeds[axis] for axis in moving])
        return enter, leave

    def face(self, segment: Vector) -> tuple[int, int]:
        """Return axis and sign of the coordinate of greatest magnitude at apex + segment; x, y, z on a tie (NRM-2)."""
        steps = applied(self.to_local, segment)
        point = [start + step for start, step in zip(self.start, steps, strict=True)]
        axis = 0
        for next_axis in (1, 2):
            # |a| > |b| as (a - b)(a + b) > 0.
            if self.field.sign((point[next_axis] - point[axis]) * (point[next_axis] + point[axis])) > 0:
                axis = next_axis
        return axis, -1 if self.field.sign(point[axis]) < 0 else 1

    def blocks_itself(self, face: tuple[int, int]) -> bool:
        """Return whether the cube is between the apex and a point on its face `face`, exactly."""
        axis, sign = face
        return self.outside and sign * self.exact_start[axis] < fmpq(1, 2)


# Planes, squares and triangles seen from a rational apex: every test is a sign of inner products with exact vectors.
#
# Triangles by Cramer's rule with the determinant's sign factored out, so that no division precedes a decision (HIT-6);
# squares and planes in object space (HIT-4, HIT-7).


class SeenPlane:
    """The plane z = 0, or the square if `bounded`, in object space."""

    def __init__(self, field: NumberField, shape: Shape, apex: Rational) -> None:
        place = placement_of(shape)
        start = place.local(apex)
        self.field = field
        self.x, self.y, self.z = (RowVector(field, row) for row in place.inverse)
        self.start = numbers(field, start)
        self.bounded = isinstance(shape, Square)
        self.upward = numbers(field, place.inverse[2])

    def crossing(self, direction: Vector, window: Window) -> tuple[Number, int] | None:
        """Return t in the window, and the branch 0, or None; raise UndecidedError."""
        speed = self.z(direction)
        if self.field.sign(speed) == 0:
            return None
        t = -self.start[2] / speed
        if t not in window:
            return None
        if self.bounded:
            for start, row in ((self.start[0], self.x), (self.start[1], self.y)):
                twice = (start + t * row(direction)) * 2
                if self.field.sign(1 - twice) <= 0 or self.field.sign(1 + twice) <= 0:
                    return None
        return t, 0

    def at(self, direction: Vector, branch: int) -> Number:
        """Return t where the ray is known to hit."""
        del branch
        return -self.start[2] / self.z(direction)

    def blocks_itself(self, segment: Vector) -> bool:
        """Return False: a plane has no second root."""
        del segment
        return False

    def normal(self, segment: Vector) -> Vector:
        """Return the normal, of any length."""
        del segment
        return self.upward


class SeenTriangle:
    """A triangle by Cramer's rule: u, v and the determinant are inner products of the direction with fixed vectors."""

    def __init__(self, field: NumberField, shape: Triangle | Mesh, face: int, apex: Rational) -> None:
        first, second, third = corners_of(shape, face)
        first_edge, second_edge, to_apex = minus(second, first), minus(third, first), minus(apex, first)
        by_determinant = cross(second_edge, first_edge)
        winding = winding_of(shape, face)
        self.field = field
        # A triangle without area, in object space or in the world, is never hit.
        self.empty = not any(by_determinant) or not any(winding)
        self.determinant = RowVector(field, by_determinant)
        self.u, self.v = RowVector(field, cross(second_edge, to_apex)), RowVector(field, cross(to_apex, first_edge))
        self.height = field.number(dot(cross(to_apex, first_edge), second_edge))
        turned = transposed(placement_of(shape).inverse)
        self.upward = numbers(field, rational(dot(row, winding) for row in turned))

    def crossing(self, direction: Vector, window: Window) -> tuple[Number, int] | None:
        """Return t in the window, and the branch 0, or None; raise UndecidedError."""
        if self.empty:
            return None
        sign = self.field.sign
        determinant = self.determinant(direction)
        side = sign(determinant)
        if side == 0:
            return None
        u = self.u(direction)
        if sign(u) * side < 0:
            return None
        v = self.v(direction)
        if sign(v) * side < 0 or sign(determinant - u - v) * side < 0:
            return None
        t = self.height / determinant
        return (t, 0) if t in window else None

    def at(self, direction: Vector, branch: int) -> Number:
        """Return t where the ray is known to hit."""
        del branch
        return self.height / self.determinant(direction)

    def blocks_itself(self, segment: Vector) -> bool:
        """Return False: a triangle has no second root."""
        del segment
        return False

    def normal(self, segment: Vector) -> Vector:
        """Return the outward normal, of any length."""
        del segment
        return self.upward


# Spheres under any affine map, seen from a rational apex: the unit sphere and a line in its space (HIT-1, NRM-1).


class SeenSphere:
    """A sphere by |start + t along|^2 = 1; `power` is the exact power of the apex."""

    def __init__(self, field: NumberField, shape: Sphere, apex: Rational) -> None:
        place = placement_of(shape)
        start = place.local(apex)
        power = dot(start, start) - 1
        self.field = field
        self.to_unit = rows(field, place.inverse)
        self.from_unit = rows(field, transposed(place.inverse))
        self.start = numbers(field, start)
        self.power = field.number(power)
        self.outside = power > fmpq(0)

    def crossing(self, direction: Vector, window: Window) -> tuple[Number, int] | None:
        """Return the smallest t in the window and which root it is (-1: the smaller), or None; raise UndecidedError."""
        along = applied(self.to_unit, direction)
        square, half = dot(along, along), dot(self.start, along)
        discriminant = half * half - square * self.power
        if self.field.sign(discriminant) < 0:
            return None
        root = self.field.sqrt(discriminant)
        for branch in (-1, 1):
            t = (root - half if branch > 0 else -half - root) / square
            if t in window:
                return t, branch
        return None

    def at(self, direction: Vector, branch: int) -> Number:
        """Return t of a root that exists."""
        along = applied(self.to_unit, direction)
        square, half = dot(along, along), dot(self.start, along)
        root = self.field.sqrt(half * half - square * self.power)
        return (root - half if branch > 0 else -half - root) / square

    def blocks_itself(self, segment: Vector) -> bool:
        """Return whether the sphere is between the apex and its own point at t = 1.

        The root of that point is divided out: the other root of the quadratic around it is t = -2h/a, which has the
        sign of -h.
        """
        if not self.outside:
            return False
        along = applied(self.to_unit, segment)
        point = tuple(start + step for start, step in zip(self.start, along, strict=True))
        return self.field.sign(dot(point, along)) > 0

    def normal(self, segment: Vector) -> Vector:
        """Return the outward normal, of any length, at the apex + segment."""
        along = applied(self.to_unit, segment)
        x, y, z = (start + step for start, step in zip(self.start, along, strict=True))
        return applied(self.from_unit, (x, y, z))
