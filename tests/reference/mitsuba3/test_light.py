"""Visibility, irradiance, exitance and Mitsuba's images against closed forms."""

import numpy as np
import pytest

from rayproof.cases.scene import Cube, Plane, PointLight, Scene, Sphere, Square
from rayproof.cases.stages import Stage
from tests.reference.mitsuba3.geometry import GENERIC, WHITE, answer, directions, looking_down

ALBEDO = (0.2, 0.5, 0.9)
FIRST = PointLight(position=(0.3, -0.2, 2.5), flux=(100.0, 70.0, 30.0))
SECOND = PointLight(position=(-1.1, 0.7, 1.5), flux=(10.0, 20.0, 90.0))
CLOSE = 20 * 2.0**-24
LIGHT = (Stage.VISIBILITY, Stage.IRRADIANCE, Stage.RADIANCE)


def raised(height, size=1.0):
    return ((size, 0, 0, 0), (0, size, 0, 0), (0, 0, 1, height), (0, 0, 0, 1.0))


def floor_irradiance(points, light):
    to_light = np.asarray(light.position) - points
    squared = (to_light**2).sum(-1)
    return np.asarray(light.flux) / (4 * np.pi) * (to_light[..., 2] / squared**1.5)[..., None]


@pytest.mark.parametrize("lights", [(FIRST,), (FIRST, SECOND)], ids=["one-light", "two-lights"])
def test_a_floor_is_lit_by_the_inverse_square_and_cosine_laws_and_lights_add(mitsuba, lights):
    scene = Scene(camera=looking_down(height=5), shapes=(Plane(albedo=ALBEDO),), lights=lights)

    visibility, irradiance, exitance, radiance, position = answer(
        mitsuba, scene, Stage.VISIBILITY, Stage.IRRADIANCE, Stage.EXITANCE, Stage.RADIANCE, Stage.POSITION
    )

    expected = sum(floor_irradiance(position, light) for light in lights)
    assert visibility.shape[-1] == len(lights)
    assert np.all(visibility == 1)
    assert np.abs(irradiance / expected - 1).max() <= CLOSE
    assert np.abs(exitance / (expected * ALBEDO) - 1).max() <= CLOSE
    assert np.abs(radiance * np.pi / (expected * ALBEDO) - 1).max() <= CLOSE


@pytest.mark.parametrize(
    ("blocker_height", "blocked"), [(1.0, True), (3.0, False)], ids=["below-the-light", "above-the-light"]
)
def test_only_what_stands_between_point_and_light_casts_a_shadow(mitsuba, blocker_height, blocked):
    light = PointLight(position=(0, 0, 2), flux=(10.0, 10.0, 10.0))
    blocker = Square(albedo=WHITE, to_world=raised(blocker_height, 0.6))
    camera = looking_down(height=1.5, fovy=80) if not blocked else looking_down(height=8, fovy=25)
    scene = Scene(camera=camera, shapes=(Plane(albedo=WHITE), blocker), lights=(light,))

    shape, position, visibility, _, radiance = answer(mitsuba, scene, Stage.OBJECT, Stage.POSITION, *LIGHT)

    floor = shape[..., 0] == 0
    half = 0.3 * 2 / (2 - blocker_height) if blocked else -1.0
    outward = np.abs(position[..., :2]).max(-1)
    clear = floor & (np.abs(outward - half) > 1e-3)
    assert clear.sum() > 300
    assert np.array_equal(visibility[clear, 0] == 1, outward[clear] > half)
    assert np.array_equal(radiance[clear, 0] > 0, outward[clear] > half)
    if blocked:
        assert np.any(outward[clear] < half)


@pytest.mark.parametrize("light_side", [1, -1], ids=["lit-from-front", "lit-from-behind"])
@pytest.mark.parametrize("eye_side", [1, -1], ids=["seen-from-front", "seen-from-behind"])
@pytest.mark.parametrize("two_sided", [False, True], ids=["one-sided", "two-sided"])
def test_sidedness(mitsuba, light_side, eye_side, two_sided):
    light = PointLight(position=(0.1, 0.2, 2.0 * light_side), flux=(10.0, 10.0, 10.0))
    camera = looking_down(height=3.0 * eye_side, fovy=10)
    scene = Scene(camera=camera, shapes=(Square(albedo=WHITE, two_sided=two_sided),), lights=(light,))

    normal, visibility, irradiance, radiance = answer(mitsuba, scene, Stage.NORMAL, *LIGHT)

    facing = eye_side if two_sided else 1
    lit = light_side == facing
    assert np.all(normal == (0, 0, facing))
    assert np.all(visibility == lit)
    assert np.all((irradiance > 0) == lit)
    assert np.all((radiance > 0) == (lit and (two_sided or eye_side > 0)))


@pytest.mark.parametrize("samples", [2, 8])
def test_many_samples_are_the_mean_over_the_centers_of_a_regular_subdivision(mitsuba, samples):
    camera = looking_down(height=4, width=9, rows=7, fovy=40)
    turned = ((0.9, -0.4, 0, 0.13), (0.4, 0.9, 0, -0.07), (0, 0, 1, 0), (0, 0, 0, 1.0))
    scene = Scene(camera=camera, shapes=(Square(albedo=ALBEDO, to_world=turned),), lights=(FIRST,))

    (radiance,) = answer(mitsuba, scene, Stage.RADIANCE, samples=samples)

    ray = directions(camera, samples)
    points = camera.eye - 4 / ray[..., 2:] * ray
    local = (points - (0.13, -0.07, 0)) @ np.linalg.inv(turned)[:3, :3].T
    inside = np.abs(local[..., :2]).max(-1) < 0.5
    expected = (inside[..., None] * floor_irradiance(points, FIRST) * ALBEDO / np.pi).mean(axis=2)
    share = inside.mean(axis=2)
    assert np.any((share > 0.2) & (share < 0.8))
    assert np.abs(radiance - expected).max() <= CLOSE * expected.max()


def test_the_image_agrees_with_the_stages_seen_by_a_generic_camera(mitsuba):
    scene = Scene(
        camera=GENERIC,
        shapes=(Sphere(albedo=ALBEDO), Cube(albedo=WHITE, to_world=raised(0.8, 0.7), two_sided=True)),
        lights=(PointLight(position=(2, -3, 4), flux=(50.0, 60.0, 70.0)), SECOND),
    )

    exitance, normal, ray, radiance = answer(mitsuba, scene, Stage.EXITANCE, Stage.NORMAL, Stage.RAY, Stage.RADIANCE)

    seen = (normal * ray).sum(-1, keepdims=True) < 0
    assert radiance.max() > 0
    assert np.abs(radiance - np.where(seen, exitance / np.pi, 0)).max() <= 4 * CLOSE * radiance.max()
