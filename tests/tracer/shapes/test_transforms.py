"""Placements: there and back again, and nothing computed for nothing."""

import drjit as dr
import numpy as np

from rayproof.cases.rounding import UNIT_ROUNDOFF
from rayproof.cases.scene import IDENTITY
from rayproof.tracer.kernel.arrays import array_types
from rayproof.tracer.shapes.shape import Transform
from tests.tracer.scenes import affine


def test_a_point_survives_the_way_to_object_space_and_back(precision: str) -> None:
    types = array_types(precision)
    transform = Transform(to_world=affine(7, (1.0, -2.0, 3.0)))
    point = types.Vector(0.3, -0.7, 1.9)

    back = transform.point_to_world(transform.point_to_object(point))

    assert dr.norm(back - point)[0] <= 64 * UNIT_ROUNDOFF[precision] * 5


def test_a_normal_stays_perpendicular_to_the_surface(precision: str) -> None:
    types = array_types(precision)
    transform = Transform(to_world=affine(8, (0.0, 0.0, 0.0), mirror=True))
    tangent, normal = types.Vector(0.6, 0.0, 0.8), types.Vector(-0.8, 0.0, 0.6)

    turned = transform.vector_to_world(tangent), transform.normal_to_world(normal)

    assert abs(dr.dot(*turned)[0]) <= 32 * UNIT_ROUNDOFF[precision]


def test_coefficients_of_zero_and_one_cost_nothing() -> None:
    types = array_types("float32")
    point = types.Vector(types.Float(np.array([1.0, 2.0], dtype=np.float32)))

    same = Transform(to_world=IDENTITY).vector_to_object(point)

    assert [a.index for a in same] == [b.index for b in point]
