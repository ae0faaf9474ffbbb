"""Where shapes are, in exact fractions: the inverse of a matrix of floats is rational."""

from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache

from rayproof.cases.scene import Shape, Sphere
from rayproof.reference.double_double.constants import Rational, cross, dot, fractions, minus


@dataclass(frozen=True, kw_only=True)
class Placement:
    """object point = inverse times (world point - offset)."""

    inverse: tuple[Rational, Rational, Rational]
    offset: Rational

    def local(self, point: Rational) -> Rational:
        """Return a world point [m] in object space."""
        x, y, z = (dot(row, minus(point, self.offset)) for row in self.inverse)
        return (x, y, z)


@lru_cache(maxsize=256)
def placement_of(shape: Shape) -> Placement:
    """Return the exact inverse placement; a sphere's leads to the unit sphere."""
    rows = [[Fraction(float(value)) for value in row] for row in shape.to_world[:3]]
    offset = [row[3] for row in rows]
    if isinstance(shape, Sphere):
        center = fractions(shape.center)
        offset = [move + dot(row[:3], center) for row, move in zip(rows, offset, strict=True)]
        rows = [[value * Fraction(shape.radius) for value in row] for row in rows]
    x, y, z = ([row[axis] for row in rows] for axis in range(3))
    cofactors = (cross(y, z), cross(z, x), cross(x, y))
    volume = dot(x, cofactors[0])
    first, second, third = ((row[0] / volume, row[1] / volume, row[2] / volume) for row in cofactors)
    return Placement(inverse=(first, second, third), offset=(offset[0], offset[1], offset[2]))
