"""Visibility, irradiance, exitance and radiance against closed forms."""

import numpy as np
import pytest

from rayproof.cases.families import select
from rayproof.cases.scene import Plane, PointLight, Scene, Sphere, Square
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Analytic
from rayproof.reference.radiance import scene as radiance_scene
from tests.reference.mitsuba3.geometry import WHITE, answer, directions, looking_down

ALBEDO = (0.2, 0.5, 1.9)
FIRST = PointLight(position=(0.3, -0.2, 2.5), flux=(100.0, 70.0, 30.0))
SECOND = PointLight(position=(-1.1, 0.7, 1.5), flux=(1e300, 20.0, 0.0))
LIGHT = (Stage.VISIBILITY, Stage.IRRADIANCE, Stage.EXITANCE, Stage.RADIANCE)


def close(radiance, scene, stage):
    # What it declares of its float32 colours, and float64's own few.
    return radiance.resolution(scene, stage).relative + 1e-13


def floor_irradiance(points, light):
    to_light = np.asarray(light.position) - points
    squared = (to_light**2).sum(-1)
    return np.asarray(light.flux) / (4 * np.pi) * (to_light[..., 2] / squared**1.5)[..., None]


@pytest.mark.parametrize(
    "lights", [(FIRST,), (FIRST, SECOND), (FIRST, FIRST)], ids=["one-light", "two-lights", "in-one-place"]
)
def test_a_floor_is_lit_by_the_inverse_square_and_cosine_laws_and_lights_add(radiance, lights):
    scene = Scene(camera=looking_down(height=5), shapes=(Plane(albedo=ALBEDO),), lights=lights)

    visibility, irradiance, exitance, leaving, position = answer(radiance, scene, *LIGHT, Stage.POSITION)

    expected = sum(floor_irradiance(position, light) for light in lights)
    assert visibility.shape[-1] == len(lights)
    assert np.all(visibility == 1)
    assert np.abs(irradiance / expected - 1).max() <= close(radiance, scene, Stage.IRRADIANCE)
    assert np.abs(exitance / (expected * ALBEDO) - 1).max() <= close(radiance, scene, Stage.EXITANCE)
    assert np.abs(leaving * np.pi / (expected * ALBEDO) - 1).max() <= close(radiance, scene, Stage.RADIANCE)


@pytest.mark.parametrize(
    ("blocker_height", "blocked"), [(1.0, True), (3.0, False)], ids=["below-the-light", "above-the-light"]
)
@pytest.mark.parametrize("facing", [1.0, -1.0], ids=["facing-the-light", "facing-away"])
def test_only_what_stands_between_point_and_light_casts_a_shadow(radiance, blocker_height, blocked, facing):
    light = PointLight(position=(0, 0, 2), flux=(10.0, 10.0, 10.0))
    matrix = ((0.6, 0, 0, 0), (0, 0.6, 0, 0), (0, 0, facing, blocker_height), (0, 0, 0, 1.0))
    camera = looking_down(height=8, fovy=25) if blocked else looking_down(height=1.5, fovy=80)
    shapes = (Plane(albedo=WHITE), Square(albedo=WHITE, to_world=matrix))
    scene = Scene(camera=camera, shapes=shapes, lights=(light,))

    shape, position, visibility, _, _, leaving = answer(radiance, scene, Stage.OBJECT, Stage.POSITION, *LIGHT)

    half = 0.3 * 2 / (2 - blocker_height) if blocked else -1.0
    outward = np.abs(position[..., :2]).max(-1)
    clear = (shape[..., 0] == 0) & (np.abs(outward - half) > 1e-4)
    assert clear.sum() > 300
    assert np.array_equal(visibility[clear, 0] == 1, outward[clear] > half)
    assert np.array_equal(leaving[clear, 0] > 0, outward[clear] > half)


@pytest.mark.parametrize("two_sided", [False, True])
def test_a_surface_lit_on_its_far_side_is_lit_but_not_seen_to_be_unless_it_turns_to_the_viewer(radiance, two_sided):
    # The camera is above, the square faces downward, the light is below: on the side of the outward normal.
    downward = ((4.0, 0, 0, 0), (0, 4.0, 0, 0), (0, 0, -1.0, 0), (0, 0, 0, 1.0))
    light = PointLight(position=(0.2, 0.1, -2), flux=(10.0, 10.0, 10.0))
    square = Square(albedo=WHITE, two_sided=two_sided, to_world=downward)
    scene = Scene(camera=looking_down(height=5, fovy=30), shapes=(square,), lights=(light,))

    visibility, irradiance, _, leaving = answer(radiance, scene, *LIGHT)

    assert np.all(visibility == (not two_sided))
    assert np.all((irradiance > 0) == (not two_sided))
    assert not leaving.any()


def test_from_inside_a_two_sided_sphere_its_wall_is_lit_by_lambert(radiance):
    light = PointLight(position=(0.2, -0.1, 0.3), flux=(10.0, 20.0, 30.0))
    camera = looking_down(height=0.5, fovy=70, near=0.01)
    scene = Scene(camera=camera, shapes=(Sphere(albedo=WHITE, two_sided=True),), lights=(light,))

    position, visibility, irradiance = answer(radiance, scene, Stage.POSITION, Stage.VISIBILITY, Stage.IRRADIANCE)

    to_light = np.asarray(light.position) - position
    distance = np.linalg.norm(to_light, axis=-1)
    expected = -(to_light * position).sum(-1) / (4 * np.pi * distance**3)
    assert np.all(visibility == 1)
    assert np.abs(irradiance / (expected[..., None] * light.flux) - 1).max() <= close(radiance, scene, Stage.IRRADIANCE)


@pytest.mark.parametrize("samples", [2, 3])
def test_samples_are_the_mean_over_the_centers_of_a_pixel_s_parts(radiance, samples, monkeypatch):
    monkeypatch.setattr(radiance_scene, "AT_ONCE", 3 * 25 * 33)  # several portions
    camera = looking_down(height=5)
    scene = Scene(camera=camera, shapes=(Plane(albedo=ALBEDO),), lights=(FIRST, SECOND))

    (mean,) = answer(radiance, scene, Stage.RADIANCE, samples=samples)

    ray = directions(camera, samples)
    points = camera.eye - 5 * ray / ray[..., 2:]
    expected = np.mean(floor_irradiance(points, FIRST) + floor_irradiance(points, SECOND), axis=2) * ALBEDO / np.pi
    assert np.abs(mean / expected - 1).max() <= close(radiance, scene, Stage.RADIANCE)


def test_the_colours_of_a_narrow_view_are_within_what_it_declares_of_its_float32(radiance):
    # 1200 pixels of nearly one value, of which some are off by more than four roundings.
    (case,) = select(["random/1/287"])

    (found,) = answer(radiance, case.scene, Stage.RADIANCE)
    (expected,) = answer(Analytic(), case.scene, Stage.RADIANCE)

    assert np.abs(found / expected - 1).max() <= close(radiance, case.scene, Stage.RADIANCE)
