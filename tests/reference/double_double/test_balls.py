"""No ray that meets a shape is ruled out, however it grazes; most that pass it by are."""

from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from rayproof.cases.placement import world_triangles
from rayproof.cases.scene import Cube, Mesh, Plane, Shape, Sphere, Square, Triangle
from rayproof.reference.double_double.arithmetic import Pair, types
from rayproof.reference.double_double.shapes import PairSpan
from rayproof.reference.double_double.worlds import ball_of
from tests.reference.analytic.scenes import icosphere, matrix

COUNT = 20_000
APEX = (3.1, -2.3, 1.7)  # m
ENDLESS = PairSpan(low=None, high=None, speed=None)
GREY = (0.5, 0.5, 0.5)
SKEW = matrix([[1.0, 0.3, 0.0], [-0.2, 0.8, 0.1], [0.4, 0.0, 1.3]], (40.3, -0.1, 0.2))

SHAPES: dict[str, Shape] = {
    "sphere": Sphere(albedo=GREY, center=(0.1, 0.2, 0.3), radius=0.6),
    "ellipsoid": Sphere(albedo=GREY, center=(30.0, 0.0, -20.0), radius=0.6, to_world=SKEW),
    "cube": Cube(albedo=GREY, to_world=SKEW),
    "square": Square(albedo=GREY, to_world=SKEW),
    "triangle": Triangle(albedo=GREY, vertices=((0.0, -1.0, 1.0), (0.5, 0.2, 1.2), (-0.4, 0.1, 1.6)), to_world=SKEW),
    "mesh": icosphere(1),
}


def shadow_ray() -> PairSpan:
    float64 = types().Float64
    return PairSpan(low=None, high=Pair(float64(1), float64(0)), speed=None)


def pairs(rays: np.ndarray) -> Any:
    float64 = types().Float64
    return tuple(Pair(float64(np.ascontiguousarray(column)), float64(0)) for column in rays.T)


def may_be_met(shape: Shape, rays: np.ndarray, span: PairSpan = ENDLESS) -> np.ndarray:
    x, y, z = (Fraction(value) for value in APEX)
    ball = ball_of(shape, (x, y, z), types())
    assert ball is not None
    return ball.may_be_met(pairs(rays), span).numpy()


def points_of(shape: Shape) -> np.ndarray:
    """Return random points of a shape, many of them on its rim [m]."""
    generator = np.random.default_rng(5)
    if isinstance(shape, Triangle | Mesh):
        corners = world_triangles(shape).astype(np.float64)
        weights = generator.dirichlet((0.2, 0.2, 0.2), COUNT)
        return np.einsum("nk,nkc->nc", weights, corners[generator.integers(len(corners), size=COUNT)])
    if isinstance(shape, Sphere):
        local = generator.normal(size=(COUNT, 3))
        local = shape.radius * local / np.linalg.norm(local, axis=1, keepdims=True) + shape.center
    else:
        local = generator.choice([-0.5, 0.5, 0.1], size=(COUNT, 3))
        local[:, 2] *= isinstance(shape, Cube)
    place = np.array(shape.to_world)
    return local @ place[:3, :3].T + place[:3, 3]


@pytest.mark.parametrize("shape", SHAPES.values(), ids=SHAPES.keys())
def test_a_ray_to_a_point_of_the_shape_is_never_ruled_out(shape: Shape) -> None:
    rays = points_of(shape) - APEX

    assert may_be_met(shape, rays / np.linalg.norm(rays, axis=1, keepdims=True)).all()
    assert may_be_met(shape, rays, shadow_ray()).all()


def test_a_ray_that_touches_a_sphere_is_not_ruled_out_and_one_a_millionth_wider_is() -> None:
    ball = Sphere(albedo=GREY, center=(0.1, 0.2, 0.3), radius=0.6)
    axis = np.subtract(ball.center, APEX)
    distance = np.linalg.norm(axis)
    around = np.cross(axis, np.random.default_rng(6).normal(size=(COUNT, 3)))
    around /= np.linalg.norm(around, axis=1, keepdims=True)

    def touching(radius: float) -> np.ndarray:
        sine = radius / distance
        return np.sqrt(1 - sine**2) * axis / distance + sine * around

    assert may_be_met(ball, touching(ball.radius)).all()
    assert not may_be_met(ball, touching(ball.radius * (1 + 1e-6))).any()


@pytest.mark.parametrize("shape", SHAPES.values(), ids=SHAPES.keys())
def test_what_lies_behind_the_apex_or_beyond_a_shadow_ray_is_ruled_out(shape: Shape) -> None:
    away = np.subtract(points_of(shape), APEX)

    assert not may_be_met(shape, -away).any()
    if shape is not SHAPES["mesh"]:  # it is too large for its distance
        assert not may_be_met(shape, away / 100, shadow_ray()).any()


def test_rays_too_short_to_be_squared_and_rays_that_are_no_numbers_rule_out_nothing() -> None:
    tiny, nothing = np.full((2, 3), 1e-160), np.full((2, 3), np.nan)

    assert may_be_met(SHAPES["cube"], tiny).all()
    assert may_be_met(SHAPES["cube"], nothing).all()


def test_a_plane_has_no_ball() -> None:
    assert ball_of(Plane(albedo=GREY), (Fraction(0), Fraction(0), Fraction(1)), types()) is None
