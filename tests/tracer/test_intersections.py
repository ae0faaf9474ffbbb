"""What geometry demands of every intersection formula, however it computes."""

from typing import Any

import drjit as dr
import numpy as np
import pytest

from rayproof.cases.rounding import UNIT_ROUNDOFF
from rayproof.cases.scene import Cube, Plane, Shape, Sphere, Square, Triangle
from rayproof.tracer.formulas import FORMULAS, Formula
from rayproof.tracer.kernel.arrays import array_types
from rayproof.tracer.rays import Interval, Ray
from rayproof.tracer.shapes.primitives import traced
from tests.tracer.scenes import ALBEDO

RIGHT = {
    slot: [formula for formula in FORMULAS.variants(slot) if formula.kind == "right"]
    for slot in ("sphere", "cube", "plane", "square", "triangle")
}
UNIT: dict[str, Shape] = {
    "sphere": Sphere(albedo=ALBEDO),
    "cube": Cube(albedo=ALBEDO),
    "plane": Plane(albedo=ALBEDO),
    "square": Square(albedo=ALBEDO),
    "triangle": Triangle(albedo=ALBEDO, vertices=((-1.0, -1.0, 0.0), (1.0, -1.0, 0.0), (0.0, 1.0, 0.0))),
}
ALL = [pytest.param(slot, formula, id=formula.name) for slot, found in RIGHT.items() for formula in found]
SOLID = [pytest.param(slot, formula, id=formula.name) for slot in ("sphere", "cube") for formula in RIGHT[slot]]
FLAT = [
    pytest.param(slot, formula, id=formula.name) for slot in ("plane", "square", "triangle") for formula in RIGHT[slot]
]


def distances(
    slot: str,
    formula: Formula,
    precision: str,
    rays: list[tuple[Any, Any]],
    *,
    nearest: float = 0.0,
    farthest: float = dr.inf,
) -> np.ndarray:
    """Return t for rays (origin, direction) against the unit primitive of `slot`."""
    types = array_types(precision)
    kind = np.float64 if precision == "float64" else np.float32
    origins, directions = (np.array([ray[k] for ray in rays], dtype=kind).T for k in range(2))
    ray = Ray(origin=types.Vector(origins), direction=types.Vector(directions))
    interval = Interval(nearest=types.Float(nearest), farthest=types.Float(farthest))
    return np.array(formula.function(ray, traced(UNIT[slot]).arrays(types), interval), dtype=np.float64)


def signed_distance(slot: str, points: np.ndarray) -> np.ndarray:
    """Return how far points are from the surface of the unit primitive, where they lie within its outline."""
    match slot:
        case "sphere":
            return np.linalg.norm(points, axis=-1) - 1
        case "cube":
            return np.abs(points).max(axis=-1) - 0.5
        case _:
            return points[:, 2]


@pytest.mark.parametrize(("slot", "formula"), ALL)
def test_hits_lie_on_the_surface_and_some_rays_hit(slot: str, formula: Formula, precision: str) -> None:
    generator = np.random.default_rng(11)
    origins = generator.normal(size=(500, 3)) * 0.3 + (0.5, -2.0, 3.0)
    directions = generator.normal(size=(500, 3)) * 0.2 - origins
    kind = np.float64 if precision == "float64" else np.float32
    origins, directions = origins.astype(kind).astype(float), directions.astype(kind).astype(float)

    t = distances(slot, formula, precision, list(zip(origins, directions, strict=True)))

    hit = np.isfinite(t)
    points = origins[hit] + t[hit, np.newaxis] * directions[hit]
    assert hit.sum() > 300
    assert not np.isnan(t).any()
    # gamma(few) of the coordinates, about 4 m, times the slope of the ray against the surface.
    textbook = 16 if formula.variant == "textbook" else 1
    assert np.abs(signed_distance(slot, points)).max() <= 64 * textbook * 4 * UNIT_ROUNDOFF[precision]


@pytest.mark.parametrize(("slot", "formula"), ALL)
def test_what_is_behind_or_beside_is_missed(slot: str, formula: Formula, precision: str) -> None:
    rays = [
        ((0.1, 0.2, 5.0), (0.0, 0.1, 1.0)),  # away from it
        ((0.1, 0.2, 5.0), (1.0, 0.1, 0.0)),  # above it, parallel to z = 0
        ((0.1, 0.2, -5.0), (0.1, 0.0, -1.0)),
    ]

    assert np.isposinf(distances(slot, formula, precision, rays)).all()


@pytest.mark.parametrize(("slot", "formula"), ALL)
def test_from_behind_is_hit_too(slot: str, formula: Formula, precision: str) -> None:
    t = distances(slot, formula, precision, [((0.1, 0.2, -5.0), (0.0, 0.0, 1.0))])

    assert 4 <= t[0] <= 5


@pytest.mark.parametrize(("slot", "formula"), ALL)
def test_a_direction_twice_as_long_halves_t(slot: str, formula: Formula, precision: str) -> None:
    origin, direction = (0.25, -0.125, 4.0), np.array((0.03125, 0.0625, -1.0))

    once, twice = distances(slot, formula, precision, [(origin, direction), (origin, 2 * direction)])

    assert once == 2 * twice


@pytest.mark.parametrize(("slot", "formula"), ALL)
def test_only_the_interval_counts(slot: str, formula: Formula, precision: str) -> None:
    rays = [((0.1, 0.2, 5.0), (0.0, 0.0, -1.0))]
    first = distances(slot, formula, precision, rays)[0]

    later = distances(slot, formula, precision, rays, nearest=first)[0]
    earlier = distances(slot, formula, precision, rays, farthest=first)[0]

    assert np.isposinf(earlier)
    assert later > first if slot in ("sphere", "cube") else np.isposinf(later)


@pytest.mark.parametrize(("slot", "formula"), SOLID)
def test_from_inside_the_far_side_is_hit(slot: str, formula: Formula, precision: str) -> None:
    t = distances(slot, formula, precision, [((0.0, 0.0, 0.0), (0.0, 0.0, -1.0))])

    assert t[0] == (1.0 if slot == "sphere" else 0.5)


@pytest.mark.parametrize(("slot", "formula"), FLAT)
def test_a_ray_inside_the_plane_of_a_flat_primitive_misses_it(slot: str, formula: Formula, precision: str) -> None:
    t = distances(slot, formula, precision, [((-3.0, 0.0, 0.0), (1.0, 0.0, 0.0)), ((-3.0, 0.1, 0.0), (1.0, 0.0, -0.0))])

    assert np.isposinf(t).all()


@pytest.mark.parametrize("formula", RIGHT["cube"], ids=lambda formula: formula.name)
@pytest.mark.parametrize("zero", [0.0, -0.0])
@pytest.mark.parametrize("face", [-0.5, 0.5])
def test_a_ray_in_a_face_of_the_closed_cube_hits_it(formula: Formula, precision: str, face: float, zero: float) -> None:
    rays = [((face, 0.25, 3.0), (zero, zero, -1.0)), ((0.25, face, 3.0), (zero, zero, -1.0))]

    assert (distances("cube", formula, precision, rays) == 2.5).all()


@pytest.mark.parametrize(("slot", "formula"), ALL)
def test_a_nan_or_infinite_ray_is_a_miss(slot: str, formula: Formula, precision: str) -> None:
    rays = []
    for bad in (np.nan, np.inf, -np.inf):
        for place in range(6):
            numbers = [0.1, 0.2, 5.0, 0.0, 0.0, -1.0]
            numbers[place] = bad
            rays.append((numbers[:3], numbers[3:]))

    t = distances(slot, formula, precision, rays)

    assert not np.isnan(t).any()


@pytest.mark.parametrize("formula", RIGHT["sphere"], ids=lambda formula: formula.name)
def test_a_sphere_around_the_eye_and_one_that_is_touched(formula: Formula, precision: str) -> None:
    rays = [((0.0, 0.0, 1.0), (0.0, 1.0, 0.0)), ((0.0, 0.0, 1.0), (0.0, 0.0, 1.0)), ((2.0, 0.0, 0.0), (0.0, 1.0, 0.0))]

    assert np.isposinf(distances("sphere", formula, precision, rays)).all()
