"""POV-Ray's light, by trace() and by pictures, against closed forms."""

from dataclasses import replace

import numpy as np
import pytest

from rayproof.cases.scene import Plane, Scene, Square
from rayproof.cases.stages import Stage
from tests.reference.pictured import (
    ALBEDO,
    FIRST,
    SECOND,
    answer,
    floor_irradiance,
    floor_points,
    looking_down,
    raised,
)

CLOSE = 1e-12


def step(povray, scene):
    return povray.resolution(scene, Stage.RADIANCE).relative


def test_a_floor_is_lit_by_the_inverse_square_and_cosine_laws_and_lights_add(povray):
    # A light near the floor: the darkest pixel has a hundredth of the brightest one's light.
    lights = (FIRST, replace(SECOND, position=(-1.1, 0.7, 0.2)))
    scene = Scene(camera=looking_down(height=5), shapes=(Plane(albedo=ALBEDO),), lights=lights)

    visibility, irradiance, exitance, radiance = answer(
        povray, scene, Stage.VISIBILITY, Stage.IRRADIANCE, Stage.EXITANCE, Stage.RADIANCE
    )

    expected = sum(floor_irradiance(floor_points(scene.camera), light) for light in lights)
    assert np.all(visibility == 1)
    assert visibility.shape[-1] == 2
    assert np.abs(irradiance / expected - 1).max() <= CLOSE
    assert np.abs(exitance / (expected * ALBEDO) - 1).max() <= CLOSE
    assert np.abs(radiance * np.pi / (expected * ALBEDO) - 1).max() <= step(povray, scene)


def test_simplified_light_has_neither_a_square_law_nor_pi(povray):
    scene = Scene(camera=looking_down(height=5), shapes=(Plane(albedo=ALBEDO),), lights=(FIRST,), shading="simplified")

    irradiance, radiance = answer(povray, scene, Stage.IRRADIANCE, Stage.RADIANCE)

    to_light = np.asarray(FIRST.position) - floor_points(scene.camera)
    expected = np.asarray(FIRST.flux) * (to_light[..., 2] / np.linalg.norm(to_light, axis=-1))[..., None]
    assert np.abs(irradiance / expected - 1).max() <= CLOSE
    assert np.abs(radiance / (expected * ALBEDO) - 1).max() <= step(povray, scene)


@pytest.mark.parametrize("two_sided", [False, True], ids=["one-sided", "two-sided"])
def test_a_one_sided_surface_is_black_from_behind_and_lit_on_its_front(povray, two_sided):
    below = replace(FIRST, position=(0.0, 0.0, -2.0))
    turned = ((1, 0, 0, 0), (0, -1, 0, 0), (0, 0, -1, 0), (0, 0, 0, 1.0))
    square = Square(albedo=ALBEDO, to_world=turned, two_sided=two_sided)
    scene = Scene(camera=looking_down(height=3), shapes=(square,), lights=(FIRST, below))

    normal, visibility, radiance = answer(povray, scene, Stage.NORMAL, Stage.VISIBILITY, Stage.RADIANCE)

    assert normal[9, 12, 2] == (1 if two_sided else -1)
    assert list(visibility[9, 12]) == ([1, 0] if two_sided else [0, 1])
    assert radiance[9, 12].all() == two_sided


def test_only_what_stands_between_point_and_light_casts_a_shadow(povray):
    light = replace(FIRST, position=(0.0, 0.0, 2.0))
    under = Square(albedo=ALBEDO, to_world=raised(1.0, 0.6))
    over = Square(albedo=ALBEDO, to_world=raised(3.0, 9.0, x=5.0))
    scene = Scene(camera=looking_down(height=8, fovy=20), shapes=(Plane(albedo=ALBEDO), under, over), lights=(light,))

    objects, visibility, radiance = answer(povray, scene, Stage.OBJECT, Stage.VISIBILITY, Stage.RADIANCE)

    floor = objects[..., 0] == 0
    points = floor_points(scene.camera)
    shaded = floor & (np.abs(points[..., :2]).max(axis=-1) < 0.6)
    assert shaded.sum() > 3
    assert np.array_equal(visibility[floor, 0] == 0, shaded[floor])
    assert np.array_equal(radiance[floor].any(axis=-1), ~shaded[floor])


def test_samples_are_the_centres_of_a_regular_subdivision(povray):
    scene = Scene(camera=looking_down(height=5), shapes=(Plane(albedo=ALBEDO),), lights=(FIRST,))

    (radiance,) = answer(povray, scene, Stage.RADIANCE, samples=2)

    fine = floor_irradiance(floor_points(scene.camera, 2), FIRST) * ALBEDO / np.pi
    expected = fine.reshape(19, 2, 25, 2, 3).mean(axis=(1, 3))
    assert np.abs(radiance / expected - 1).max() <= step(povray, scene)


def test_what_gets_no_light_is_exactly_black(povray):
    dark = replace(FIRST, position=(0.0, 0.0, -1.0))
    scene = Scene(camera=looking_down(height=5), shapes=(Plane(albedo=ALBEDO),), lights=(dark,))

    irradiance, radiance = answer(povray, scene, Stage.IRRADIANCE, Stage.RADIANCE)

    assert not irradiance.any()
    assert not radiance.any()


def test_no_lights_no_light(povray):
    scene = Scene(camera=looking_down(height=5), shapes=(Plane(albedo=ALBEDO),))

    visibility, radiance = answer(povray, scene, Stage.VISIBILITY, Stage.RADIANCE)

    assert visibility.shape == (19, 25, 0)
    assert not radiance.any()


@pytest.mark.parametrize("shapes", [(), (Plane(albedo=ALBEDO, to_world=raised(50.0)),)], ids=["nothing", "behind"])
def test_where_nothing_is_hit_no_light_is_seen(povray, shapes):
    scene = Scene(camera=looking_down(height=5), shapes=shapes, lights=(FIRST, SECOND))

    visibility, exitance, radiance = answer(povray, scene, Stage.VISIBILITY, Stage.EXITANCE, Stage.RADIANCE)

    assert visibility.shape == (19, 25, 2)
    assert not any(values.any() for values in (visibility, exitance, radiance))
