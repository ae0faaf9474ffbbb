"""`rayproof shrink` from the command line: its files, its exit codes, and a public bug report in ten lines."""

import csv
import json
import shlex
from pathlib import Path

import pytest
from PIL import Image

from rayproof import ROOT
from rayproof.cases.scene import Sphere
from rayproof.cases.scene_json import load_scene
from rayproof.reports.publish.page.case_data import small_of
from rayproof.reports.results.case_table import named
from rayproof.reports.results.document import load_results
from tests.reports.commands.conftest import Rayproof


@pytest.mark.references
def test_a_sphere_that_vanishes_from_afar_becomes_an_issue_of_ten_lines(rayproof: Rayproof, tmp_path: Path) -> None:
    # https://github.com/ziotom78/pytracer/issues/22: a sphere of 0.1 m, which float32 misses from afar.
    out, reported = tmp_path / "small", ROOT / "examples" / "findings" / "vanishing_sphere.json"
    ended = rayproof("shrink", reported, "--formula", "sphere/textbook", "--out", out)

    assert ended.code == 0, ended.error
    scene = load_scene(out / "scene.json")
    (sphere,) = scene.shapes
    assert isinstance(sphere, Sphere)
    assert (scene.camera.width, scene.camera.height, scene.lights) == (1, 1, ())
    lines = (out / "issue.md").read_text().splitlines()
    assert len(lines) == 10
    text = "\n".join(lines)
    assert "# Wrong hit at object: 1 sphere" in text
    assert "HIT-1 (sphere, quadratic)" in text
    assert "| object.V | -1 | 0 |" in text
    assert "All references together: fail at object" in text
    assert "run scene.json --configuration=float32 --formula=sphere/textbook`" in text
    pixel = json.loads((out / "pixel.json").read_text())
    distance = pixel["channels"]["distance.V"]
    assert distance["got"] == "inf"
    assert distance["low"] <= distance["high"] < distance["low"] * (1 + 1e-12)
    assert "| distance.V | inf |" in (out / "pixel.md").read_text()
    with Image.open(out / "picture.png") as picture:
        assert picture.size == (260, 96)
        assert len(picture.convert("RGB").getcolors() or ()) > 2
    (vector,) = csv.DictReader((out / "vector.csv").read_text().splitlines())
    assert (vector["item"], vector["space"], vector["decision32"]) == ("HIT-1", "object", "1")
    assert float(vector["t_in_low"]) == pytest.approx(distance["low"], rel=1e-6)
    assert (float(vector["radius"]), float(vector["o_x"])) == (sphere.radius, scene.camera.eye[0])
    # The command of the issue shows it again.
    again = rayproof(
        "run", out / "scene.json", "--configuration=float32", "--formula=sphere/textbook", "--out", tmp_path / "run"
    )
    assert again.code == 1


def test_what_cannot_be_shrunk_ends_in_one_line(rayproof: Rayproof, tmp_path: Path) -> None:
    for words, complaint in (
        (["primitives/sphere"], "primitives/sphere: nothing fails"),
        (["primitives/spheer"], "spheer"),
        (["primitives/sphere", "--stage", "colour"], "no stage is called 'colour'"),
        (["primitives/sphere", "--tries", "0"], "--tries must be at least 1"),
        (["primitives/sphere", "--seconds", "0"], "--seconds must be positive"),
        (["primitives/sphere", "--subject", "radiance", "--formula", "sphere/textbook"], "--formula are the tracer's"),
    ):
        ended = rayproof("shrink", *words, "--out", tmp_path / "small")
        assert ended.code == 2
        assert complaint in ended.error
        assert ended.error.count("\n") == 1


def test_ctrl_c_leaves_the_smallest_scene_so_far(
    rayproof: Rayproof, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from rayproof.reports.commands.shrink import _Progress

    told = _Progress.__call__

    def stop(self: _Progress, search: object) -> None:
        told(self, search)  # pyright: ignore[reportArgumentType]
        if search.tries == 4:  # pyright: ignore[reportAttributeAccessIssue]
            raise KeyboardInterrupt

    monkeypatch.setattr(_Progress, "__call__", stop)
    ended = rayproof("shrink", "shadows/every_blocker", "--formula", "sphere/fault_far_root", "--out", tmp_path)

    assert ended.code == 130
    assert "interrupted" in ended.out
    assert len(load_scene(tmp_path / "scene.json").shapes) == 1
    assert "All references" not in (tmp_path / "issue.md").read_text()


@pytest.mark.references
@pytest.mark.process
def test_a_run_prints_the_command_and_the_case_s_page_shows_what_it_left(rayproof: Rayproof, tmp_path: Path) -> None:
    ran = rayproof("run", "primitives/sphere", "--configuration=float32/sphere=fault_far_root", "--out", tmp_path)
    (line,) = [line for line in ran.out.splitlines() if line.startswith("the smallest scene that fails")]
    program, *words = shlex.split(line.partition(": ")[2])
    case = named(load_results(tmp_path)["cases"], "primitives/sphere")
    assert case is not None
    before = small_of(tmp_path, case)

    ended = rayproof(*words, "--tries", 30)

    assert Path(program).name == "rayproof"
    assert ended.code == 0, ended.error
    assert before is None
    assert small_of(tmp_path, case) == "small/primitives/sphere"
    assert len(load_scene(tmp_path / "small/primitives/sphere/scene.json").shapes) == 1
    assert small_of(tmp_path, {**case, "scene": "scenes/../../elsewhere.json"}) is None
