"""A cone about a shape holds every direction in which a ray can meet it, and few of the others."""

import dataclasses

import drjit as dr
import numpy as np

from rayproof.cases.scene import Sphere
from rayproof.tracer.kernel.arrays import array_types
from rayproof.tracer.kernel.parameters import LITERALS
from rayproof.tracer.shapes.primitives import traced
from rayproof.tracer.trees.beams import Directions, cone
from tests.tracer.scenes import ALBEDO, FLOOR, shapes


def test_a_ray_at_any_point_of_a_shape_may_meet_it(precision: str) -> None:
    types, generator = array_types(precision), np.random.default_rng(5)
    kind = np.float64 if precision == "float64" else np.float32
    met = []
    for shape in shapes(generator, 1.0, np.zeros(3))[:5]:
        found = traced(shape).ball
        assert found is not None
        center, radius = found
        origin = (center + generator.normal(size=3) * radius * 5).tolist()
        about = cone(traced(shape), origin, precision)
        assert about is not None
        outward = generator.normal(size=(3, 4096))
        points = center[:, np.newaxis] + radius * outward / np.linalg.norm(outward, axis=0)
        aims = types.Vector(np.ascontiguousarray(points - np.asarray(origin)[:, np.newaxis], dtype=kind))
        others = types.Vector(np.ascontiguousarray(outward, dtype=kind))

        def may(*directions: object, about: object = about) -> np.ndarray:
            return np.array(about.may_meet(Directions(directions, types), types, LITERALS, name="shape"))  # type: ignore[attr-defined]

        assert may(aims).all()
        assert may(others, aims).all()  # one of several is enough
        assert np.array(about.reversed.may_meet(Directions([-aims], types), types, LITERALS, name="shape")).all()
        met.append(may(others).mean())
    assert 0 < np.mean(met) < 0.1


def test_no_cone_is_about_what_has_no_end_or_holds_the_point() -> None:
    sphere = Sphere(albedo=ALBEDO, center=(0.0, 0.0, 1.0))

    assert cone(traced(FLOOR), (0.0, 0.0, 5.0), "float32") is None
    assert cone(traced(sphere), (0.0, 0.0, 1.0), "float32") is None
    assert cone(traced(sphere), (0.0, 0.9, 1.0), "float32") is None
    assert cone(traced(sphere), (0.0, 0.0, 5.0), "float32") is not None
    # Where float32 cannot tell the point from the surface.
    far = dataclasses.replace(sphere, center=(1e6, 0.0, 0.0))
    assert cone(traced(far), (1e6 + 2, 0.0, 0.0), "float32") is None
    assert cone(traced(far), (1e6 + 2, 0.0, 0.0), "float64") is not None


def test_a_direction_that_is_no_number_bounds_nothing() -> None:
    types = array_types("float32")
    about = cone(traced(Sphere(albedo=ALBEDO)), (0.0, 0.0, 5.0), "float32")
    assert about is not None
    nobody, down = types.Vector(dr.nan), types.Vector(0, 0, -1)

    def may(directions: list, **active: object) -> bool:
        found = about.may_meet(Directions(directions, types, **active), types, LITERALS, name="sphere")  # type: ignore[arg-type]
        return bool(np.array(found).all())

    for place in range(3):  # in whichever order they are compared
        assert may([down if k == place else nobody for k in range(3)])
    assert not may([nobody, nobody])
    assert not may([down, types.Vector(1, 0, 0)], active=[types.Bool(False), types.Bool(True)])
    assert not may([down], active=[types.Bool(False)])
