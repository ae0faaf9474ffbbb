"""Spheres under any affine map, seen from a rational apex: the unit sphere and a line in its space (HIT-1, NRM-1)."""

from flint import fmpq

from rayproof.cases.scene import Sphere
from rayproof.reference.certified.fields import Field, Number, Vector
from rayproof.reference.certified.intervals import Window
from rayproof.reference.certified.placements import placement_of, transposed
from rayproof.reference.certified.vectors import Rational, applied, dot, numbers, rows


class SeenSphere:
    """|start + t along|^2 = 1, with `power` the power of the apex, exactly."""

    def __init__(self, field: Field, shape: Sphere, apex: Rational) -> None:
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
        """Return t of a root that is known to exist."""
        along = applied(self.to_unit, direction)
        square, half = dot(along, along), dot(self.start, along)
        root = self.field.sqrt(half * half - square * self.power)
        return (root - half if branch > 0 else -half - root) / square

    def blocks_itself(self, segment: Vector) -> bool:
        """Return whether the sphere lies between the apex and its own point at t = 1.

        That point's root is divided out: of the quadratic around it only t = -2h/a is left, and h tells its sign.
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
