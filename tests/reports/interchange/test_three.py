"""glTF out: trimesh reads back the same triangles, and three.js renders the oracle's image from the file."""

import os
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from scipy.spatial import KDTree

from rayproof.cases.families import select
from rayproof.cases.placement import world_triangles
from rayproof.cases.scene import Mesh
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Analytic
from rayproof.reports.interchange import export_scene
from rayproof.reports.interchange.stand_ins import FLAT, rebuilt
from rayproof.reports.subjects.program import ask_program
from tests.reports.subjects.test_other_files import put_to_test

RENDERER = Path(__file__).with_name("three_renderer.mjs")
MODULES = Path(os.environ.get("RAYPROOF_THREE", "."))  # the folder in which `npm install three` was run
CASES = ["primitives/cube", "transforms/cube_sheared", "meshes/mirrored_torus"]


@pytest.mark.parametrize("name", CASES)
def test_trimesh_reads_back_the_same_triangles(name: str, tmp_path: Path) -> None:
    (case,) = select([name])
    meshes = rebuilt(case.scene, dict.fromkeys((kind for kind in FLAT if kind != "mesh"), "mesh")).scene.shapes
    expected = np.concatenate([world_triangles(shape) for shape in meshes if isinstance(shape, Mesh)])

    export_scene(replace(case.scene, shapes=meshes), tmp_path / "scene.gltf")
    found = trimesh.load_scene(tmp_path / "scene.gltf").to_mesh().triangles

    assert found.shape == expected.shape
    # trimesh orders the meshes otherwise, and turns the corners of mirrored ones around. glTF stores
    # float32: corners of up to 10 m are rounded by 5e-7 m each, which three coordinates of three corners may add.
    rows, others = (np.sort(triangles, axis=1).reshape(-1, 9) for triangles in (found, expected))
    nearest: Any = KDTree(others).query(rows)
    assert nearest[0].max() < 1e-5
    assert len({*nearest[1].tolist()}) == len(expected)


@pytest.mark.process
@pytest.mark.parametrize("name", CASES[:2])
def test_three_js_renders_the_oracle_s_image_from_gltf(name: str) -> None:
    if shutil.which("node") is None or not (MODULES / "node_modules" / "three").is_dir():
        pytest.skip("node, or three in the folder that RAYPROOF_THREE names, is not installed")
    words = f"node {RENDERER} {MODULES.resolve()} {{scene.gltf}} {{output.pfm}} {{width}} {{height}}"
    # Node reserves more address space than a program usually may have.
    subject = replace(put_to_test(f"exec:{words}"), memory=2**40)
    (case,) = select([name])
    scene = subject.capabilities.asked(case.scene)

    answers = ask_program(subject, scene, samples=1)

    assert answers.error is None
    image, truth = answers.answers[Stage.RADIANCE], Analytic().render(scene, [Stage.RADIANCE])[Stage.RADIANCE]
    assert np.isclose(image, truth, rtol=1e-4, atol=1e-6 * truth.max()).mean() > 0.995
