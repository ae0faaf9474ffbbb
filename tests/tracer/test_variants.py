"""What the literature says of its formulas, at a point where each is told from the others."""

from typing import Any

import drjit as dr
import numpy as np
import pytest

from rayproof.cases.rounding import UNIT_ROUNDOFF
from rayproof.cases.scene import Sphere
from rayproof.cases.stages import Stage
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.formulas import FORMULAS
from rayproof.tracer.kernel.arrays import ArrayTypes, array_types
from rayproof.tracer.rays import Interval, Ray
from rayproof.tracer.render import render
from rayproof.tracer.shapes.meshes import TriangleArrays
from rayproof.tracer.shapes.primitives import CubeArrays, SphereArrays
from tests.tracer.scenes import ALBEDO, camera, scene

u = UNIT_ROUNDOFF["float32"]


def vector(types: ArrayTypes, values: np.ndarray) -> Any:
    return types.Vector(*(types.Float(np.ascontiguousarray(values[..., k], dtype=np.float32)) for k in range(3)))


def anywhere(types: ArrayTypes) -> Interval:
    return Interval(nearest=types.Float(0), farthest=types.Float(dr.inf))


def unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def far_sphere_error(variant: str, distance: float) -> float:
    """Return the median error of t in radii, for rays that hit a unit sphere at its middle half."""
    types, rng = array_types("float32"), np.random.default_rng(6)
    origin = (unit(rng.normal(size=(4000, 3))) * distance).astype(np.float32)
    direction = unit(unit(rng.normal(size=(4000, 3))) * 0.5 - origin).astype(np.float32)
    sphere = SphereArrays(center=types.Vector(0), radius=types.Float(1))
    ray = Ray(origin=vector(types, origin), direction=vector(types, direction))
    t = np.array(FORMULAS[f"sphere/{variant}"].function(ray, sphere, anywhere(types)), dtype=np.float64)

    o, d = origin.astype(np.longdouble), direction.astype(np.longdouble)
    a = (d * d).sum(axis=1)
    foot = -(o * d).sum(axis=1) / a
    closest = o + foot[:, np.newaxis] * d
    exact = foot - np.sqrt((1 - (closest * closest).sum(axis=1)) / a)
    # A miss counts as off by the whole sphere.
    return float(np.median(np.abs(np.where(np.isfinite(t), t, distance + 1) - exact)))


@pytest.mark.parametrize("variant", ["textbook", "half_b", "stable_quadratic", "kahan"])
def test_these_spheres_lose_the_square_of_distance_over_radius(variant: str) -> None:
    assert 30 <= far_sphere_error(variant, 512.0) / far_sphere_error(variant, 64.0) <= 130


@pytest.mark.parametrize("variant", ["haines", "pbrt4", "shift", "float64"])
def test_these_spheres_lose_no_more_than_t_itself(variant: str) -> None:
    for distance in (64.0, 512.0, 4096.0):
        assert far_sphere_error(variant, distance) <= 2 * u * distance


def leaks(variant: str, *, away: float, corner: bool) -> float:
    """Return the share of rays through an inner edge or corner of a rough square sheet that miss all its triangles."""
    types, rng = array_types("float32"), np.random.default_rng(7)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    middle = away * np.array((1.0, 0.7, -0.4))
    count, rays = 4, 4000
    grid = np.stack([*np.meshgrid(np.arange(count + 1), np.arange(count + 1), indexing="ij")], axis=-1) / count * 2 - 1
    points = np.concatenate([grid, np.zeros((count + 1, count + 1, 1))], axis=-1)
    points = ((points + rng.normal(size=points.shape) * 0.05) @ turn.T + middle).astype(np.float32)
    share = 0.0 if corner else rng.uniform(size=(rays, 1))
    target = points[2, 2] * (1 - share) + points[2, 1] * share
    origin = (middle + turn @ (0.3, 0.2, 3.0) + rng.normal(size=(rays, 3)) * 0.5).astype(np.float32)
    ray = Ray(origin=vector(types, origin), direction=vector(types, target - origin))

    hit = np.zeros(rays, dtype=bool)
    for i in range(count):
        for j in range(count):
            a, b, c, d = points[i, j], points[i + 1, j], points[i + 1, j + 1], points[i, j + 1]
            for corners in ((a, b, c), (a, c, d)):
                first, second, third = (types.Vector(*map(float, x)) for x in corners)
                triangle = TriangleArrays(first=first, second=second, third=third)
                hit |= np.isfinite(np.array(FORMULAS[f"triangle/{variant}"].function(ray, triangle, anywhere(types))))
    return 1 - hit.mean()


@pytest.mark.parametrize("away", [0.0, 1e3, 1e5])
@pytest.mark.parametrize("corner", [False, True], ids=["edge", "corner"])
@pytest.mark.parametrize("variant", ["woop", "woop_kahan", "woop_float64_fallback"])
def test_woop_s_triangles_are_watertight(variant: str, away: float, *, corner: bool) -> None:
    assert leaks(variant, away=away, corner=corner) == 0


@pytest.mark.parametrize("variant", ["moeller_trumbore", "signed_areas", "baldwin_weber"])
def test_other_triangles_leak(variant: str) -> None:
    assert leaks(variant, away=0.0, corner=False) > 0.01


def test_a_scaled_falloff_outlives_the_square_of_the_distance() -> None:
    types = array_types("float32")
    away, flux = types.Vector(2e19, 0.0, 0.0), types.Vector(1e8)

    direct = FORMULAS["falloff/inverse_square"].function(flux, dr.squared_norm(away))
    scaled = FORMULAS["falloff/scaled"].function(flux, away)

    assert direct.x[0] == 0
    assert scaled.x[0] == pytest.approx(1e8 / (4 * np.pi) / 4e38, rel=1e-5)


def test_a_reprojected_hit_lies_on_its_sphere() -> None:
    far = scene(
        Sphere(albedo=ALBEDO, center=(0.1, 0.2, 0.3)), camera=camera(eye=(300.0, -600.0, 350.0), fovy=0.1, far=1e4)
    )

    off = {}
    for variant in ("along_ray", "reprojected"):
        answers = render(far, (Stage.OBJECT, Stage.POSITION), Configuration(formulas={"position": variant}))
        hit = answers[Stage.OBJECT][..., 0] == 0
        off[variant] = np.abs(np.linalg.norm(answers[Stage.POSITION][hit] - (0.1, 0.2, 0.3), axis=-1) - 1).max()

    assert off["reprojected"] <= 4 * u
    assert off["along_ray"] > 30 * u


@pytest.mark.parametrize("inside", [False, True], ids=["outside", "inside"])
def test_the_slab_that_was_met_is_the_greatest_coordinate(precision: str, *, inside: bool) -> None:
    types, rng = array_types(precision), np.random.default_rng(9)
    kind = np.float64 if precision == "float64" else np.float32
    origin = (rng.uniform(-0.4, 0.4, (500, 3)) if inside else unit(rng.normal(size=(500, 3))) * 3).astype(kind)
    direction = (rng.uniform(-0.4, 0.4, (500, 3)) - origin).astype(kind)
    ray = Ray(origin=types.Vector(origin.T), direction=types.Vector(direction.T))
    t = FORMULAS["cube/slabs"].function(ray, CubeArrays(), anywhere(types))

    by_point = np.array(FORMULAS["cube_normal/greatest"].function(ray.at(t)))
    by_slab = np.array(FORMULAS["cube_normal/entering_slab"].function(ray, t))

    hit = np.isfinite(np.array(t))
    assert hit.sum() > 400
    np.testing.assert_array_equal(by_slab[:, hit], by_point[:, hit])
