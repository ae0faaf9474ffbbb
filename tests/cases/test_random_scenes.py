"""Random scenes stay what their names say, are valid, and have every hostile feature often enough."""

import json

import numpy as np
import pytest

from rayproof.cases.families import select
from rayproof.cases.placement import world_triangles
from rayproof.cases.random_scenes import case_named, counted, random_scene, wide_case
from rayproof.cases.random_scenes.features import FEATURES
from rayproof.cases.scene import Cube, Mesh, Plane, Sphere, Square, Triangle
from rayproof.cases.scene_json import scene_from_json, scene_to_json

MANY = 1000
NAMES = [f"random/5/{number}" for number in range(MANY)]


def test_a_name_stands_for_one_scene():
    case = case_named("random/1/17")

    assert random_scene(1, 17)[0] == case.scene != case_named("random/2/17").scene
    assert (type(case.scene.shapes[0]).__name__, case.scene.camera.width, case.scene.camera.height) == (
        "Sphere",
        64,
        48,
    )
    assert case.scene.camera.eye == pytest.approx(
        (-1.4950828142807615, 2.923227071090778, 1.1331429351412703), rel=1e-12
    )


def test_each_feature_is_in_two_scenes_of_a_hundred():
    counts = counted(NAMES)

    assert set(FEATURES) < set(counts)
    assert {name: count for name, count in counts.items() if count < 0.02 * MANY} == {}
    assert {kind.__name__.lower() for kind in (Sphere, Cube, Square, Plane, Triangle, Mesh)} < set(counts)


def test_scenes_survive_their_files():
    for name in NAMES[::20]:
        scene = case_named(name).scene

        assert scene_from_json(json.loads(json.dumps(scene_to_json(scene))), None, name) == scene


@pytest.mark.parametrize("feature", list(FEATURES))
def test_a_feature_shows_in_a_scene_that_has_it(feature):
    scene = next(scene for scene, features in (random_scene(5, number) for number in range(200)) if feature in features)
    view = scene.camera
    shown = {
        "empty": not scene.shapes,
        "no_light": not scene.lights,
        "many_lights": 10 <= len(scene.lights) <= 20,
        "one_pixel": (view.width, view.height) == (1, 1),
        "few_pixels": (view.width, view.height) == (7, 3),
        "one_column": (view.width, view.height) == (1, 200),
        "narrow_view": view.fovy <= 1e-2,
        "wide_view": 150 <= view.fovy <= 175,
        "no_clip": scene.clip == "none",
        "shell_clip": scene.clip == "shell",
        "simplified": scene.shading == "simplified",
        "crowded": len(scene.shapes) > 12,
        "two_sided": all(shape.two_sided for shape in scene.shapes[:1]),
    }

    assert shown.get(feature, True)


@pytest.mark.parametrize(
    "name", ["random", "random/1", "random/1/x", "random/1/-2", "random/1/2/3", "random/1/99999999999"]
)
def test_a_name_that_is_no_scenes_is_refused(name):
    with pytest.raises(LookupError, match=r"random scene"):
        select([name])


# Wide scenes: the same shapes and lights in the same places, every field over its range.


WIDE = range(200)
WIDE_SCENES = [wide_case(31, number).scene for number in WIDE]


def test_shapes_and_lights_stay_where_they_are() -> None:
    for number, scene in zip(WIDE, WIDE_SCENES, strict=True):
        narrow = random_scene(31, number)[0]

        assert [light.position for light in scene.lights] == [light.position for light in narrow.lights]
        assert scene.camera.eye == narrow.camera.eye
        for shape, drawn in zip(scene.shapes, narrow.shapes, strict=True):
            if isinstance(shape, Sphere) and isinstance(drawn, Sphere):
                radii = [np.asarray(one.to_world)[:3, :3] * one.radius for one in (shape, drawn)]
                assert radii[0] == pytest.approx(radii[1], rel=1e-12)
            elif isinstance(shape, Triangle | Mesh):
                size = float(np.abs(world_triangles(drawn)).max())
                assert world_triangles(shape) == pytest.approx(world_triangles(drawn), abs=4e-7 * size)
