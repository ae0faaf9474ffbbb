"""`rayproof shrink` from the command line: its files, its exit codes, and a public bug report in ten lines."""

import csv
import json
from pathlib import Path

import pytest
from PIL import Image

from rayproof import ROOT
from rayproof.cases.scene import Sphere
from rayproof.cases.scene_json import load_scene
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
