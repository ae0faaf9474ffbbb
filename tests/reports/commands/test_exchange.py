"""`rayproof import` and `rayproof export`."""

import json
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
        (["export", "primitives/sphere", "a.usd"], "must end in one of .gltf"),
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


TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


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


def test_an_import_ends_with_what_it_made_and_left_out_and_the_next_command(rayproof: Rayproof, tmp_path: Path) -> None:
    shapes = "".join(
        f'<shape type="{kind}"><bsdf type="{material}"/></shape>'
        for kind in ("sphere", "cylinder", "cube", "linearcurve", "disk")
        for material in ("plastic", "conductor", "dielectric", "diffuse", "thindielectric")
    )
    (tmp_path / "many.xml").write_text(f'<scene version="3.0.0">{shapes}</scene>')

    ended = rayproof("import", tmp_path / "many.xml", "--out", tmp_path / "many.json")

    lines = ended.out.splitlines()
    end = [line for line in lines if not line.startswith("dropped: ")]
    assert lines[-len(end) :] == end
    assert len(end) <= 10
    assert "5 spheres, 5 cubes, 5 meshes (1270 triangles), 1 light, 320 x 240 px" in end[0]
    left_out = len(lines) - len(end)
    assert f"left out or replaced: {left_out} things of 9 kinds" in end[1]
    assert end[2] == "  5 x the shape cylinder"
    assert end[-1].startswith("next: ")
    assert end[-1].endswith(f"run {tmp_path / 'many.json'}")


def test_an_import_of_which_no_pixel_is_lit_says_so(rayproof: Rayproof, tmp_path: Path) -> None:
    (tmp_path / "dark.xml").write_text(
        '<scene version="3.0.0"><shape type="sphere"/><sensor type="perspective"><transform name="to_world">'
        '<lookat origin="0,0,9" target="0,0,0" up="0,1,0"/></transform></sensor>'
        '<emitter type="point"><point name="position" x="0" y="0" z="-9"/></emitter></scene>'
    )

    ended = rayproof("import", tmp_path / "dark.xml", "--out", tmp_path / "dark.json")

    assert (ended.code, "note: no pixel of it is lit" in ended.out) == (0, True)


def test_a_run_of_scenes_of_which_no_pixel_is_lit_says_so(rayproof: Rayproof, tmp_path: Path) -> None:
    camera = {"eye": [0, 0, 9], "target": [0, 0, 0], "up": [0, 1, 0], "fovy": 20, "width": 8, "height": 6}
    scene = {"camera": camera | {"near": 1, "far": 20}, "shapes": [{"type": "sphere", "albedo": [1, 1, 1]}]}
    for name, z in (("dark", -9), ("lit", 9)):
        light = {"position": [0, 0, z], "flux": [9, 9, 9]}
        (tmp_path / f"{name}.json").write_text(json.dumps(scene | {"lights": [light]}))

    files = (tmp_path / "dark.json", tmp_path / "lit.json")
    ended = rayproof("run", *files, "--jobs", "1", "--out", tmp_path / "out", "--json", tmp_path / "results.json")

    assert ended.code == 0
    assert "file/dark: no pixel of it is lit" in ended.out
    cases = {case["name"]: case for case in json.loads((tmp_path / "results.json").read_text())["cases"]}
    said = {name: [note["note"] for note in case["notes"] if "lit" in note["note"]] for name, case in cases.items()}
    assert [len(said[name]) for name in ("file/dark", "file/lit")] == [1, 0]


def test_a_scene_of_the_lecture_is_imported_and_run_names_the_command(rayproof: Rayproof, tmp_path: Path) -> None:
    camera = {"target": [0, 0, 0], "eye": [0, 0, 9], "worldUp": [0, 1, 0], "width": 8, "height": 6}
    scene = {"camera": camera, "primitives": [{"shape": "Sphere"}], "lights": [{"type": "PointLight"}]}
    file = tmp_path / "lecture.json"
    file.write_text(json.dumps({"frames": [{"scene": scene}]}))

    refused = rayproof("run", file, "--out", tmp_path / "out")
    over = rayproof("import", file, "--out", file)
    read = rayproof("import", file, "--out", tmp_path / "scene.json")

    assert (refused.code, "`rayproof import`" in refused.error) == (2, True)
    assert (over.code, "is the file that is read" in over.error) == (2, True)
    assert (read.code, "no material; it is grey" in read.out) == (0, True)
    assert load_scene(tmp_path / "scene.json").camera.fovy == 45


def test_parameters_of_a_mitsuba_scene_are_given_as_mitsuba_takes_them(rayproof: Rayproof, tmp_path: Path) -> None:
    (tmp_path / "a.xml").write_text(
        '<scene version="3.0.0"><default name="r" value="2"/><shape type="sphere"><float name="radius" value="$r"/>'
        "</shape></scene>"
    )
    (tmp_path / "a.obj").write_text(TRIANGLE)

    assert rayproof("import", tmp_path / "a.xml", "-D", "r=3", "--out", tmp_path / "a.json").code == 0
    assert load_scene(tmp_path / "a.json").shapes[0].radius == 3  # type: ignore[attr-defined]
    for file, pair, message in (("a.xml", "r", "a name and a value"), ("a.obj", "r=3", "parameters of a Mitsuba")):
        ended = rayproof("import", tmp_path / file, "-D", pair)
        assert (ended.code, message in ended.error) == (2, True)
