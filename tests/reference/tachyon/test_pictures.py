"""Tachyon's coloured faces, shadows and light against closed forms."""

from dataclasses import replace

import numpy as np
import pytest

from rayproof.cases.scene import Cube, Plane, Scene, Sphere, Square
from rayproof.cases.stages import Stage
from tests.reference.pictured import (
    ALBEDO,
    FIRST,
    SECOND,
    answer,
    floor_irradiance,
    floor_points,
    looking_down,
    placed,
    raised,
    tetrahedron,
)

LIGHT = (Stage.VISIBILITY, Stage.IRRADIANCE, Stage.EXITANCE, Stage.RADIANCE)
TURNED = ((0.6, -0.8, 0), (0.8, 0.6, 0), (0, 0, 1.0))


def within(tachyon, scene):
    """Return the relative limit: half a step, and what reading the scene as float32 moves."""
    return tachyon.resolution(scene, Stage.RADIANCE).relative + 20 * 2.0**-24


@pytest.mark.parametrize("shading", ["inverse_square", "simplified"])
def test_a_floor_is_lit_by_the_light_laws_and_lights_add(tachyon, shading):
    # A light near the floor: the darkest pixel has a hundredth of the brightest one's light.
    lights = (FIRST, replace(SECOND, position=(-1.1, 0.7, 0.2)))
    shapes = (Plane(albedo=ALBEDO),)
    scene = Scene(camera=looking_down(height=5), shapes=shapes, lights=lights, shading=shading)

    visibility, irradiance, exitance, radiance = answer(tachyon, scene, *LIGHT)

    points = floor_points(scene.camera)
    if shading == "inverse_square":
        expected = sum(floor_irradiance(points, light) for light in lights)
    else:
        offsets = [np.asarray(light.position) - points for light in lights]
        cosines = [(offset[..., 2] / np.linalg.norm(offset, axis=-1))[..., None] for offset in offsets]
        expected = sum(np.asarray(light.flux) * cosine for light, cosine in zip(lights, cosines, strict=True))
    leaving = np.multiply(expected, ALBEDO) / (np.pi if shading == "inverse_square" else 1)
    assert np.all(visibility == 1)
    assert np.abs(irradiance / expected - 1).max() <= within(tachyon, scene)
    assert np.abs(exitance / (expected * ALBEDO) - 1).max() <= within(tachyon, scene)
    assert np.abs(radiance / leaving - 1).max() <= within(tachyon, scene)


def test_faces_are_told_by_their_colours(tachyon):
    flat = placed(((0.4, 0, 0), (0, -0.4, 0), (0, 0, 0.4)), 1.0, 0.0, 0.5)
    shapes = (
        Plane(albedo=ALBEDO),
        Sphere(albedo=ALBEDO, radius=0.5, to_world=raised(1)),
        Cube(albedo=ALBEDO, to_world=flat),
    )
    scene = Scene(camera=looking_down(height=5), shapes=(*shapes, tetrahedron(to_world=placed(TURNED, -1, 0, 1))))

    (objects,) = answer(tachyon, scene, Stage.OBJECT)

    assert list(objects[9, 12]) == [1, 0]
    assert list(objects[0, 0]) == [0, 0]
    assert set(objects[..., 0].ravel()) == {0, 1, 2, 3}
    # From above, the faces that the upper edge of the tetrahedron parts.
    assert set(objects[objects[..., 0] == 3][:, 1]) == {1, 2}
    assert not objects[objects[..., 0] == 2][:, 1].any()


def test_misses_are_marked_and_dark(tachyon):
    scene = Scene(camera=looking_down(height=5), shapes=(Sphere(albedo=ALBEDO, radius=0.5),), lights=(FIRST,))

    objects, visibility, radiance = answer(tachyon, scene, Stage.OBJECT, Stage.VISIBILITY, Stage.RADIANCE)

    missed = objects[..., 0] < 0
    assert missed[0, 0]
    assert not missed[9, 12]
    assert np.all(objects[missed] == -1)
    assert not visibility[missed].any()
    assert not radiance[missed].any()


def test_only_what_stands_between_point_and_light_casts_a_shadow(tachyon):
    light = replace(FIRST, position=(0.0, 0.0, 2.0))
    under = Square(albedo=ALBEDO, to_world=raised(1.0, 0.6))
    over = Square(albedo=ALBEDO, to_world=raised(3.0, 9.0, x=5.0))
    scene = Scene(camera=looking_down(height=8, fovy=20), shapes=(Plane(albedo=ALBEDO), under, over), lights=(light,))

    objects, visibility, radiance = answer(tachyon, scene, Stage.OBJECT, Stage.VISIBILITY, Stage.RADIANCE)

    floor = objects[..., 0] == 0
    shaded = floor & (np.abs(floor_points(scene.camera)[..., :2]).max(axis=-1) < 0.6)
    assert shaded.sum() > 3
    assert np.array_equal(visibility[floor, 0] == 0, shaded[floor])
    assert np.array_equal(radiance[floor].any(axis=-1), ~shaded[floor])


def test_a_one_sided_surface_is_black_from_behind(tachyon):
    turned = ((1, 0, 0, 0), (0, -1, 0, 0), (0, 0, -1, 0), (0, 0, 0, 1.0))
    scene = Scene(camera=looking_down(height=3), shapes=(Square(albedo=ALBEDO, to_world=turned),), lights=(FIRST,))
    two_sided = replace(scene, shapes=(replace(scene.shapes[0], two_sided=True),))

    (from_behind,) = answer(tachyon, scene, Stage.RADIANCE)
    (either,) = answer(tachyon, two_sided, Stage.RADIANCE)

    assert not from_behind.any()
    assert either[9, 12].all()


def test_samples_are_the_centres_of_a_regular_subdivision(tachyon):
    scene = Scene(camera=looking_down(height=5), shapes=(Plane(albedo=ALBEDO),), lights=(FIRST,))

    (radiance,) = answer(tachyon, scene, Stage.RADIANCE, samples=3)

    fine = floor_irradiance(floor_points(scene.camera, 3), FIRST) * ALBEDO / np.pi
    expected = fine.reshape(19, 3, 25, 3, 3).mean(axis=(1, 3))
    assert np.abs(radiance / expected - 1).max() <= within(tachyon, scene)


@pytest.mark.parametrize(
    "lights", [(), (replace(FIRST, position=(0.0, 0.0, -1.0)),), (replace(FIRST, flux=(0.0, 0.0, 0.0)),)]
)
def test_what_gets_no_light_is_exactly_black(tachyon, lights):
    scene = Scene(camera=looking_down(height=5), shapes=(Plane(albedo=ALBEDO),), lights=lights)

    visibility, irradiance, radiance = answer(tachyon, scene, Stage.VISIBILITY, Stage.IRRADIANCE, Stage.RADIANCE)

    assert visibility.shape == (19, 25, len(lights))
    assert not irradiance.any()
    assert not radiance.any()
