"""Wide scenes: the same shapes and lights in the same places, every field over its range."""

import numpy as np
import pytest

from rayproof.cases.placement import world_triangles
from rayproof.cases.random import random_scene
from rayproof.cases.random.wide import wide_case
from rayproof.cases.scene import Mesh, Sphere, Triangle

MANY = range(200)
SCENES = [wide_case(31, number).scene for number in MANY]


def test_shapes_and_lights_stay_where_they_are() -> None:
    for number, scene in zip(MANY, SCENES, strict=True):
        narrow = random_scene(31, number).scene

        assert [light.position for light in scene.lights] == [light.position for light in narrow.lights]
        assert scene.camera.eye == narrow.camera.eye
        for shape, drawn in zip(scene.shapes, narrow.shapes, strict=True):
            if isinstance(shape, Sphere) and isinstance(drawn, Sphere):
                radii = [np.asarray(one.to_world)[:3, :3] * one.radius for one in (shape, drawn)]
                assert radii[0] == pytest.approx(radii[1], rel=1e-12)
            elif isinstance(shape, Triangle | Mesh):
                size = float(np.abs(world_triangles(drawn)).max())
                assert world_triangles(shape) == pytest.approx(world_triangles(drawn), abs=4e-7 * size)


def test_fields_are_drawn_over_their_ranges() -> None:
    cameras = [scene.camera for scene in SCENES]
    lengths = [float(np.linalg.norm(camera.up)) for camera in cameras]
    albedos = [max(shape.albedo) for scene in SCENES for shape in scene.shapes]

    assert min(lengths) < 0.01 < 100 < max(lengths)
    assert {(camera.width > camera.height) - (camera.width < camera.height) for camera in cameras} == {-1, 0, 1}
    assert max(camera.width / camera.height for camera in cameras) > 20
    assert min(camera.fovy for camera in cameras) < 20 < 150 < max(camera.fovy for camera in cameras)
    assert max(albedos) > 1 > min(albedos)
