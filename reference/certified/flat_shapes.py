"""Planes, squares and triangles seen from a rational apex: every test is a sign of inner products with exact vectors.

Triangles by Cramer's rule with the determinant's sign factored out, so that nothing is divided before it is decided
(HIT-6); squares and planes in their own space (HIT-4, HIT-7).
"""

from rayproof.cases.scene import Mesh, Shape, Square, Triangle
from rayproof.reference.certified.fields import Field, Number, Vector
from rayproof.reference.certified.intervals import Window
from rayproof.reference.certified.placements import corners_of, placement_of, rational, transposed, winding_of
from rayproof.reference.certified.vectors import Rational, Row, cross, dot, minus, numbers


class SeenPlane:
    """The plane z = 0, or with `bounded` the square, in object space."""

    def __init__(self, field: Field, shape: Shape, apex: Rational) -> None:
        place = placement_of(shape)
        start = place.local(apex)
        self.field = field
        self.x, self.y, self.z = (Row(field, row) for row in place.inverse)
        self.start = numbers(field, start)
        self.bounded = isinstance(shape, Square)
        self.upward = numbers(field, place.inverse[2])

    def crossing(self, direction: Vector, window: Window) -> tuple[Number, int] | None:
        """Return t in the window, and 0 for want of branches, or None; raise UndecidedError."""
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
    """t, u, v times the determinant are inner products of the direction with fixed vectors."""

    def __init__(self, field: Field, shape: Triangle | Mesh, face: int, apex: Rational) -> None:
        first, second, third = corners_of(shape, face)
        one, two, to_apex = minus(second, first), minus(third, first), minus(apex, first)
        by_determinant = cross(two, one)
        winding = winding_of(shape, face)
        self.field = field
        # Without area, before baking or after, it is never hit.
        self.empty = not any(by_determinant) or not any(winding)
        self.determinant = Row(field, by_determinant)
        self.u, self.v = Row(field, cross(two, to_apex)), Row(field, cross(to_apex, one))
        self.height = field.number(dot(cross(to_apex, one), two))
        turned = transposed(placement_of(shape).inverse)
        self.upward = numbers(field, rational(dot(row, winding) for row in turned))

    def crossing(self, direction: Vector, window: Window) -> tuple[Number, int] | None:
        """Return t in the window, and 0 for want of branches, or None; raise UndecidedError."""
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
