"""`rayproof import` and `rayproof export`."""

import struct
from pathlib import Path

import numpy as np
import pytest

from rayproof.cases.families import select
from rayproof.cases.scene import Mesh
from rayproof.cases.scene_json import load_scene
from rayproof.reports.cli import main
from tests.reports.commands.conftest import Rayproof

pytestmark = pytest.mark.process


def test_export_then_import_makes_a_scene_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    xml, scene = tmp_path / "scene.xml", tmp_path / "back.json"

    assert main(["export", "transforms/mesh_sheared", str(xml)]) == 0
    assert main(["import", str(xml), "--out", str(scene), "--width", "30", "--height", "20"]) == 0

    (case,) = select(["transforms/mesh_sheared"])
    back = load_scene(scene)
    assert len(back.shapes) == len(case.scene.shapes)
    assert (back.camera.width, back.camera.height) == (30, 20)
    assert str(scene) in capsys.readouterr().out.replace("\n", "")


def test_an_import_that_leaves_nothing_ends_with_2_and_says_what_was_left_out(
    rayproof: Rayproof, tmp_path: Path
) -> None:
    (tmp_path / "a.xml").write_text('<scene version="3.0.0"><shape type="cylinder"/></scene>')

    ended = rayproof("import", tmp_path / "a.xml", "--out", tmp_path / "a.json")

    assert (ended.code, ended.error.count("\n")) == (2, 1)
    assert "cylinder" in ended.error
    assert not (tmp_path / "a.json").exists()
    ended = rayproof("import", tmp_path / "a.xml", "--allow-folder", tmp_path / "nowhere")
    assert (ended.code, "nowhere: there is no such folder" in ended.error) == (2, True)


def test_the_scene_file_names_the_mesh_file(rayproof: Rayproof, tmp_path: Path) -> None:
    corners = np.random.default_rng(35).normal(size=(2000, 3, 3)).astype("<f4")
    content = bytes(80) + struct.pack("<I", 2000) + b"".join(bytes(12) + row.tobytes() + bytes(2) for row in corners)
    for folder in ("here", "there"):
        (tmp_path / folder).mkdir()
    (tmp_path / "here" / "dust.stl").write_bytes(content)
    (tmp_path / "there" / "dust.stl").write_text("another file")

    beside = rayproof("import", tmp_path / "here" / "dust.stl", "--out", tmp_path / "here" / "dust.json")
    copied = rayproof("import", tmp_path / "here" / "dust.stl", "--out", tmp_path / "there" / "dust.json")

    assert (beside.code, copied.code) == (0, 0)
    assert "copied" not in beside.out
    assert "copied beside it: dust-" in copied.out
    assert (tmp_path / "there" / "dust.stl").read_text() == "another file"
    for folder in ("here", "there"):
        file = tmp_path / folder / "dust.json"
        (mesh,) = load_scene(file).shapes
        assert file.stat().st_size < 2000
        assert isinstance(mesh, Mesh)
        np.testing.assert_array_equal(mesh.vertices[mesh.faces], corners)
