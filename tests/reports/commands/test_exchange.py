"""`rayproof import` and `rayproof export`."""

from pathlib import Path

import pytest

from rayproof.cases.families import select
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


def test_what_is_dropped_is_listed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")

    assert main(["import", str(tmp_path / "a.obj"), "--out", str(tmp_path / "a.json")]) == 0

    assert "dropped: a.obj" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["import", "nothing.xml"], "there is no such file"),
        (["import", "scene.usd"], "must end in one of"),
        (["import", "a.obj", "--out", "a.txt"], "must end in .json"),
        (["import", "a.obj", "--width", "3"], "go together"),
        (["export", "primitives/sphere", "a.gltf"], "must end in one of .xml"),
        (["export", "no/such", "a.xml"], "no case matches"),
    ],
)
def test_bad_usage_is_one_line_and_2(arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(arguments) == 2

    told = capsys.readouterr().err
    assert message in told
    assert told.count("\n") == 1


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
