"""Cubes under any affine map, seen from a rational apex, by slabs that are never compared where it makes no difference.

The largest entering and the smallest leaving distance are ball operations; only what they decide is asked (HIT-3).
"""

from itertools import product

from flint import fmpq

from rayproof.cases.scene import Cube
from rayproof.reference.certified.fields import Field, Number, Vector
from rayproof.reference.certified.intervals import Window
from rayproof.reference.certified.placements import placement_of
from rayproof.reference.certified.vectors import Rational, applied, numbers, rows

Branch = tuple[bool, tuple[int, int, int]]  # whether the ray enters here, and the signs of its direction


class SeenCube:
    """The cube [-1/2, 1/2]^3 in its own space."""

    def __init__(self, field: Field, shape: Cube, apex: Rational) -> None:
        place = placement_of(shape)
        self.field = field
        self.exact_start = place.local(apex)
        self.start = numbers(field, self.exact_start)
        self.to_local = rows(field, place.inverse)
        self.outside = max(abs(value) for value in self.exact_start) > fmpq(1, 2)
        half = fmpq(1, 2)
        # Of each axis the distance to the slab's face that a ray of this sign enters, times its speed.
        self.entering = {
            (axis, sign): field.number(-sign * half - self.exact_start[axis])
            for axis, sign in product(range(3), (-1, 1))
        }
        self.normals = {
            (axis, sign): numbers(field, [sign * value for value in place.inverse[axis]])
            for axis, sign in product(range(3), (-1, 1))
        }

    def crossing(self, direction: Vector, window: Window) -> tuple[Number, Branch] | None:
        """Return the smallest t in the window, and which slabs gave it, or None; raise UndecidedError."""
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
        for other in (1, 2):
            # |a| > |b| as (a - b)(a + b) > 0.
            if self.field.sign((point[other] - point[axis]) * (point[other] + point[axis])) > 0:
                axis = other
        return axis, -1 if self.field.sign(point[axis]) < 0 else 1

    def blocks_itself(self, face: tuple[int, int]) -> bool:
        """Return whether the cube lies between the apex and a point on that face of its own, exactly."""
        axis, sign = face
        return self.outside and sign * self.exact_start[axis] < fmpq(1, 2)
