"""Shapes as exact rational numbers: the floats of the scene are rationals, and so is the inverse of their matrix."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

from flint import fmpq

from rayproof.cases.placement import world_triangles
from rayproof.cases.scene import Mesh, Shape, Sphere, Triangle
from rayproof.reference.certified.fields import exact
from rayproof.reference.certified.vectors import Rational, cross, dot, minus

Square3 = tuple[Rational, Rational, Rational]


@dataclass(frozen=True, kw_only=True)
class Placement:
    """World point = linear times object point + offset, and back."""

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
    """Return the world-space corners [m] of a triangle, baked as every renderer gets them."""
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
