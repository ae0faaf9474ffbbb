"""Spheres and ellipsoids: the unit sphere in its own space."""

from typing import Any

from rayproof.cases.scene import Sphere
from rayproof.reference.double_double.branches import only_where
from rayproof.reference.double_double.constants import Rational, pair
from rayproof.reference.double_double.constants import dot as exact_dot
from rayproof.reference.double_double.pair_arithmetic import Bool, select, sqrt
from rayproof.reference.double_double.placements import placement_of
from rayproof.reference.double_double.questions import Questions
from rayproof.reference.double_double.surfaces import Crossing, Span
from rayproof.reference.double_double.vectors import Matrix, Vector, constant, cross, dot, plus, terms, unit


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

        def work(ask: Questions) -> list[Bool]:
            along = self.to_unit(segment)
            point = plus(self.start, along)
            return [ask.is_positive(dot(point, along), terms(point, along), where)]

        return only_where(where, ask, work)[0]

    def normal(self, segment: Vector, face: Any, ask: Questions, where: Bool) -> Vector:
        """Return the gradient."""
        del face
        x, y, z = only_where(where, ask, lambda _: unit(self.to_world(plus(self.start, self.to_unit(segment)))))
        return (x, y, z)
