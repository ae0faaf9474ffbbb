"""Scenes of the lecture's course: the radiance that the course's formulas give, and nothing left out in silence."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rayproof.cases.scene import Cube, Mesh, Scene, Sphere, Square
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Analytic
from rayproof.reports.interchange import Imported, ImportOptions, import_scene

pytestmark = pytest.mark.process
NO_TURN = {"rotate": [0, 0, 0], "scale": [1, 1, 1]}


def lecture_scene() -> dict[str, Any]:
    """Return a file with each shape of the course that has a counterpart."""
    scene = {
        "camera": {"target": [0, 0, 0], "eye": [0, 0, 9], "worldUp": [0, 1, 0], "fov": 40, "width": 97, "height": 73},
        "primitives": [
            {
                "shape": "SquarePlane", "name": "Wall", "material": "grey",
                "transform": {"translate": [0, 0, -1], "rotate": [0, 0, 0], "scale": [8, 8, 1]},
            },
            {"shape": "Sphere", "name": "Ball", "material": "red", "transform": {"translate": [-2, 1, 0], **NO_TURN}},
            {
                "shape": "Cube", "name": "Box", "material": "grey",
                "transform": {"translate": [2, 0.5, 0], "rotate": [10, 30, 20], "scale": [1, 1, 2]},
            },
            {
                "shape": "Mesh", "name": "Pot", "filename": "pot.obj", "material": "red",
                "transform": {"translate": [0, -2, 0], **NO_TURN},
            },
        ],
        "lights": [{
            "shape": "Point", "type": "PointLight", "name": "Lamp", "lightColor": [17, 12, 4], "intensity": 2,
            "transform": {"translate": [0, 0, 4], "rotate": [0, 0, 0], "scale": [1, 1, 1]},
        }],
        "materials": [
            {"type": "MatteMaterial", "name": "grey", "Kd": [0.8, 0.8, 0.8], "sigma": 0},
            {"type": "MatteMaterial", "name": "red", "Kd": [0.6, 0.1, 0.1], "sigma": 0},
        ],
    }  # fmt: skip
    return {"frames": [{"frameNumber": 0, "scene": scene}]}


def read(folder: Path, document: Any, options: ImportOptions | None = None) -> Imported:
    (folder / "pot.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    (folder / "lecture.json").write_text(json.dumps(document))
    return import_scene(folder / "lecture.json", options)


def test_shapes_lights_and_camera_are_the_course_s(tmp_path: Path) -> None:
    imported = read(tmp_path, lecture_scene())
    scene: Scene = imported.scene

    assert imported.dropped == ()
    assert [type(shape) for shape in scene.shapes] == [Square, Sphere, Cube, Mesh]
    assert all(shape.two_sided for shape in scene.shapes)
    assert (scene.camera.near, scene.camera.far) == (0.1, 1000)
    # The wall's middle, straight below the lamp: Kd / pi * E, E = I / r^2, I = lightColor * intensity, r = 5.
    answers = Analytic().render(scene, [Stage.RADIANCE, Stage.POSITION])
    expected = 0.8 / np.pi * 2 * np.array([17, 12, 4]) / 5**2
    np.testing.assert_allclose(answers[Stage.RADIANCE][36, 48], expected)
    np.testing.assert_allclose(answers[Stage.POSITION][36, 48], [0, 0, -1], atol=1e-12)


def test_a_shape_is_scaled_turned_about_z_y_and_x_and_moved(tmp_path: Path) -> None:
    (_, _, box, _) = read(tmp_path, lecture_scene()).scene.shapes

    x, y, z = np.radians([10, 30, 20])
    turn_x = np.array([[1, 0, 0], [0, np.cos(x), -np.sin(x)], [0, np.sin(x), np.cos(x)]])
    turn_y = np.array([[np.cos(y), 0, np.sin(y)], [0, 1, 0], [-np.sin(y), 0, np.cos(y)]])
    turn_z = np.array([[np.cos(z), -np.sin(z), 0], [np.sin(z), np.cos(z), 0], [0, 0, 1]])
    linear = turn_x @ turn_y @ turn_z @ np.diag([1, 1, 2])
    np.testing.assert_allclose(np.array(box.to_world)[:3], np.column_stack([linear, [2, 0.5, 0]]), atol=1e-15)


def primitive(document: dict[str, Any]) -> dict[str, Any]:
    return document["frames"][0]["scene"]["primitives"][1]


def material(document: dict[str, Any]) -> dict[str, Any]:
    return document["frames"][0]["scene"]["materials"][1]


def lamp(document: dict[str, Any]) -> dict[str, Any]:
    return document["frames"][0]["scene"]["lights"][0]


CHANGES: dict[str, Any] = {
    'the shape "Ball": the shape Disc': lambda d: primitive(d).update(shape="Disc"),
    'the shape "Ball": the material "blue" is not there': lambda d: primitive(d).update(material="blue"),
    'the shape "Ball": its scale of 0': lambda d: primitive(d)["transform"].update(scale=[1, 0, 1]),
    'the shape "Ball": its bumpiness': lambda d: primitive(d).update(bumpiness=3),
    'the material "red": its sigma': lambda d: material(d).update(sigma=20),
    'the material "red": its textureMap': lambda d: material(d).update(textureMap="a.png"),
    'the material "red": MirrorMaterial is taken as matte, by its Kd': lambda d: material(d).update(
        type="MirrorMaterial"
    ),
    'the light "Lamp": DiffuseAreaLight': lambda d: lamp(d).update(type="DiffuseAreaLight"),
    "1 of 2 frames": lambda d: d["frames"].append(d["frames"][0]),
    "the lens of its camera": lambda d: d["frames"][0]["scene"].update(
        thinlenscamera=d["frames"][0]["scene"].pop("camera") | {"lensRadius": 0.1, "focalDistance": 5}
    ),
    "it has no camera": lambda d: d["frames"][0]["scene"].pop("camera"),
}


@pytest.mark.parametrize("sentence", CHANGES)
def test_what_has_no_counterpart_is_listed(sentence: str, tmp_path: Path) -> None:
    document = lecture_scene()
    CHANGES[sentence](document)

    dropped = read(tmp_path, document).dropped

    assert any(sentence in line for line in dropped), dropped
    assert len(dropped) == (2 if "DiffuseAreaLight" in sentence else 1)


def test_a_mesh_lies_in_an_allowed_folder(tmp_path: Path) -> None:
    document = lecture_scene()
    document["frames"][0]["scene"]["primitives"][3]["filename"] = "../meshes/pot.obj"
    for name in ("scenes", "meshes"):
        (tmp_path / name).mkdir()
    (tmp_path / "meshes" / "pot.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")

    imported = read(tmp_path / "scenes", document, ImportOptions(allowed=(tmp_path / "meshes",)))

    assert isinstance(imported.scene.shapes[3], Mesh)
