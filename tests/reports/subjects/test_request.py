"""A program gets the very scene: its JSON keeps the schema and reads back, and meshes for shapes are these shapes."""

import json
from pathlib import Path

import jsonschema
import numpy as np

from rayproof.cases.scene import Cube, Mesh, Square, Triangle
from rayproof.cases.scene_json import load_scene, schema
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Analytic
from rayproof.reports.subjects.request import hand_over, triangulated
from tests.reports.subjects.conftest import SCENE


def test_the_scene_reads_back_to_the_last_bit(tmp_path: Path) -> None:
    path = hand_over(SCENE, tmp_path)

    document = json.loads(path.read_text())
    jsonschema.validate(document, schema())
    assert document["shapes"][4]["file"] == "mesh-4.obj"
    read = load_scene(path)
    assert (read.camera, read.lights, read.shapes[:4]) == (SCENE.camera, SCENE.lights, SCENE.shapes[:4])
    ours, theirs = SCENE.shapes[4], read.shapes[4]
    assert isinstance(ours, Mesh)
    assert isinstance(theirs, Mesh)
    assert np.array_equal(ours.vertices, theirs.vertices)
    assert np.array_equal(ours.faces, theirs.faces)


def test_meshes_for_cubes_squares_and_triangles_are_the_same_surfaces() -> None:
    stages = (Stage.OBJECT, Stage.DISTANCE, Stage.NORMAL)
    meshes = triangulated(SCENE)

    ours, theirs = (Analytic().render(scene, stages) for scene in (SCENE, meshes))

    assert not any(isinstance(shape, Cube | Square | Triangle) for shape in meshes.shapes)
    assert np.array_equal(ours[Stage.OBJECT][..., 0], theirs[Stage.OBJECT][..., 0])
    hit = ours[Stage.OBJECT][..., 0] >= 0
    # A mesh's corners are rounded to float32 in the world.
    assert np.allclose(ours[Stage.DISTANCE][hit], theirs[Stage.DISTANCE][hit], rtol=1e-6)
    assert np.allclose(ours[Stage.NORMAL], theirs[Stage.NORMAL], atol=1e-12)
