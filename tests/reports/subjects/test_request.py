"""A program gets the very scene: its JSON keeps the schema and reads back, and meshes for shapes are these shapes."""

import json
from dataclasses import replace
from pathlib import Path

import jsonschema
import numpy as np

from rayproof.cases.scene import Cube, Mesh, Square, Triangle
from rayproof.cases.scene_json import NAMES, load_scene
from rayproof.cases.scene_schema import schema
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Analytic
from rayproof.reports.interchange.stand_ins import rebuilt
from rayproof.reports.subjects.protocol import hand_over
from tests.reports.subjects.conftest import SCENE, TILTED

# Every flat shape beside the next, so that some pixels see each, and some see none.
LARGER = replace(
    SCENE,
    shapes=tuple(
        replace(shape, to_world=(*((*row[:3], place) for row, place in zip(TILTED, at, strict=False)), TILTED[3]))
        for shape, at in zip(SCENE.shapes[1:], ((-1, -1, 0), (1.2, 0.6, 0), (-1, 1.5, 0), (0, 0, -1.5)), strict=True)
    ),
    camera=replace(SCENE.camera, width=64, height=48, fovy=60.0),
)


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
    meshes = rebuilt(LARGER, dict.fromkeys(("cube", "square", "triangle"), "mesh")).scene

    ours, theirs = (Analytic().render(scene, stages) for scene in (LARGER, meshes))
    assert len(np.unique(ours[Stage.OBJECT][..., 0])) == len(LARGER.shapes) + 1

    assert not any(isinstance(shape, Cube | Square | Triangle) for shape in meshes.shapes)
    assert np.array_equal(ours[Stage.OBJECT][..., 0], theirs[Stage.OBJECT][..., 0])
    hit = ours[Stage.OBJECT][..., 0] >= 0
    # A mesh's corners are rounded to float32 in the world.
    assert np.allclose(ours[Stage.DISTANCE][hit], theirs[Stage.DISTANCE][hit], rtol=1e-6)
    assert np.allclose(ours[Stage.NORMAL], theirs[Stage.NORMAL], atol=1e-12)


def test_what_is_handed_over_in_pieces_is_taken_back_by_its_own_name() -> None:
    kinds = ("cube", "square", "mesh")
    pieces = rebuilt(LARGER, dict.fromkeys(kinds, "triangle"))
    assert not any(NAMES[type(shape)] in kinds for shape in pieces.scene.shapes)

    ours, theirs = (Analytic().render(scene, [Stage.OBJECT]) for scene in (LARGER, pieces.scene))
    assert theirs[Stage.OBJECT].max() > len(LARGER.shapes), "else nothing is to be taken back"
    named = pieces.named_as_asked(theirs)[Stage.OBJECT]

    assert np.array_equal(named, ours[Stage.OBJECT])
