"""Scenes in other programs' formats: read back they are the same scenes, and what a format cannot say is refused."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

from rayproof.cases.case import Case
from rayproof.cases.families import all_cases, select
from rayproof.cases.placement import world_triangles
from rayproof.cases.scene import Mesh, Scene, SceneError
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Analytic
from rayproof.reports.interchange import EXPORTERS, ImportOptions, SceneFormat, export_scene, import_scene
from rayproof.reports.subjects.protocol import Capabilities
from tests.reports.subjects.conftest import SCENE

# Over all families but those whose pixels lie on edges, and fall beside them when the camera's angle is rounded.
SOME = [case for case in all_cases()[::9] if case.family not in ("watertight", "tolerances")]


def says(name: str) -> SceneFormat:
    return EXPORTERS.about(f".{name}")["says"]


def reader(name: str) -> Capabilities:
    """Return what a program can do that reads a format and draws all that it says."""
    return replace(Capabilities(), scene_format=name).within(says(name))


def handed(case: Case, able: Capabilities) -> Scene | None:
    """Return what a program is handed of a case, as meshes where it draws no other shape; None if it is refused."""
    from rayproof.reports.interchange.stand_ins import rebuilt

    asked = able.asked(case.scene)
    return None if able.refusal(asked) is not None else rebuilt(able.handed(asked), able.stand_ins).scene


@pytest.mark.parametrize("case", SOME, ids=lambda case: case.name)
def test_what_is_read_back_from_gltf_is_the_scene(tmp_path: Path, case: Case) -> None:
    able = reader("gltf")
    scene = handed(case, able)
    if scene is None:
        assert able.refusal(able.asked(case.scene))
        return
    export_scene(scene, tmp_path / "scene.gltf")

    size = (scene.camera.width, scene.camera.height)
    read = import_scene(tmp_path / "scene.gltf", ImportOptions(size=size)).scene

    stages = [Stage.DISTANCE, Stage.NORMAL, Stage.RADIANCE] if scene.lights else [Stage.DISTANCE, Stage.NORMAL]
    ours = Analytic().render(scene, stages)
    theirs = Analytic().render(replace(read, lights=read.lights if scene.lights else ()), stages)
    # The camera's angle, and the place of its target, are rounded on the way. A pixel at an edge may fall beside it.
    for stage in stages:
        size = np.abs(ours[stage][np.isfinite(ours[stage])]).max(initial=0.0)
        assert (~np.isclose(ours[stage], theirs[stage], rtol=1e-6, atol=1e-6 * size)).mean() <= 0.002, stage


@pytest.mark.parametrize(("name", "least"), [("xml", 224), ("gltf", 213), ("pbrt", 209), ("pov", 257)])
def test_a_program_that_reads_a_format_gets_most_cases(name: str, least: int) -> None:
    able, some = reader(name), all_cases()[::7]

    refused = {case.name: why for case in some if (why := able.refusal(able.asked(case.scene))) is not None}

    # By hand, over all cases: `least`. Of these few the share may differ by two cases.
    assert len(refused) <= (1 - least / 257) * len(some) + 2
    assert all(why.endswith(".") for why in refused.values())


def test_trimesh_reads_the_triangles_that_gltf_was_given(tmp_path: Path) -> None:
    meshes = tuple(
        shape for case in select(["meshes", "transforms"]) for shape in case.scene.shapes if isinstance(shape, Mesh)
    )
    scene = replace(SCENE, shapes=tuple(replace(mesh, albedo=(0.2, 0.4, 0.6)) for mesh in meshes))
    export_scene(scene, tmp_path / "scene.gltf")

    read = trimesh.load_scene(tmp_path / "scene.gltf", process=False)

    assert len(read.geometry) == len(meshes) > 3
    for index, mesh in enumerate(meshes):
        placed, name = read.graph[f"shape-{index}"]
        part = read.geometry[name]
        corners = trimesh.transform_points(part.vertices, placed)[part.faces]
        expected = world_triangles(mesh).astype(np.float64)
        if np.linalg.det(np.asarray(mesh.to_world)[:3, :3]) < 0:
            corners = corners[:, [0, 2, 1]]  # trimesh leaves the winding of a mirrored node as it is
        assert np.allclose(corners, expected, rtol=1e-6, atol=1e-6 * np.abs(expected).max())


@pytest.mark.parametrize("size", [(64, 48), (40, 70)])
def test_a_camera_of_pbrt_sees_what_ours_sees(tmp_path: Path, size: tuple[int, int]) -> None:
    camera = replace(SCENE.camera, width=size[0], height=size[1], up=(0.2, 0.1, 1.0))
    export_scene(replace(SCENE, camera=camera), tmp_path / "scene.pbrt")
    text = (tmp_path / "scene.pbrt").read_text()
    places = np.array(re.search(r"LookAt (.*)", text)[1].split(), dtype=np.float64).reshape(3, 3)
    assert "Scale -1 1 1\nLookAt" in text
    fov = np.radians(float(re.search(r'"float fov" (\S+)', text)[1]))

    # pbrt, third edition, sections 2.7.7, 6.2 and 6.2.2: a left-handed view, and a screen whose shorter side is 2.
    forward = (places[1] - places[0]) / np.linalg.norm(places[1] - places[0])
    right = np.cross(places[2], forward)
    right /= np.linalg.norm(right)
    view = np.stack([-right, np.cross(forward, right), forward])
    rays = Analytic().render(replace(SCENE, camera=camera), [Stage.RAY])[Stage.RAY] @ view.T
    screen = rays[..., :2] / rays[..., 2:] / np.tan(fov / 2)
    half = np.array(size) / min(size)
    raster = (screen / half * (1, -1) + 1) / 2 * size

    rows, columns = np.mgrid[: size[1], : size[0]]
    assert np.allclose(raster, np.stack([columns, rows], axis=-1) + 0.5, atol=1e-9)


def test_shapes_without_a_word_are_written_as_meshes_and_said(tmp_path: Path) -> None:
    notes = export_scene(SCENE, tmp_path / "scene.gltf")

    assert any("sphere: it is a mesh of flat triangles" in note for note in notes)
    assert any("cube: it is an equal mesh" in note for note in notes)
    assert any("6 x 4 px" in note for note in notes)
    assert len(json.loads((tmp_path / "scene.gltf").read_text())["meshes"]) == len(SCENE.shapes)


def test_a_plane_up_to_its_horizon_has_no_square(tmp_path: Path) -> None:
    scene = select(["clipping/horizon_none"])[0].scene

    with pytest.raises(SceneError, match="up to its horizon"):
        export_scene(scene, tmp_path / "scene.gltf")
