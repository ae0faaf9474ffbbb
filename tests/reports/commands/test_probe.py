"""`rayproof probe` shows what each renderer says about one pixel, and where it says nothing."""

import json
from pathlib import Path

import pytest

from rayproof.cases.families import select
from rayproof.cases.scene_json import save_scene
from rayproof.cases.stages import Stage
from rayproof.reference import REFERENCES
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.formulas import FORMULAS
from rayproof.tracer.render import render
from tests.reports.commands.conftest import Rayproof

pytestmark = pytest.mark.references


def test_every_renderer_answers_every_stage(rayproof: Rayproof, tmp_path: Path) -> None:
    ended = rayproof("probe", "primitives/sphere", 48, 36, "--json", tmp_path / "pixel.json")

    assert ended.code == 0
    columns = json.loads((tmp_path / "pixel.json").read_text())["renderers"]
    usual = {name for name in REFERENCES if not REFERENCES.about(name).get("on_request", False)}
    assert set(columns) == {"tracer-float32", "tracer-float64", *usual}
    for values in columns.values():
        assert {name.split(".")[0] for name in values} >= {str(stage) for stage in Stage}


def test_the_values_are_the_renderer_s_own(rayproof: Rayproof, tmp_path: Path) -> None:
    rayproof("probe", "primitives/cube", 50, 30, "--json", tmp_path / "pixel.json")

    shown = json.loads((tmp_path / "pixel.json").read_text())["renderers"]["tracer-float64"]
    scene = select(["primitives/cube"])[0].scene
    answers = render(scene, [Stage.NORMAL, Stage.RADIANCE], Configuration(precision="float64"))
    assert [shown[f"normal.{axis}"] for axis in "XYZ"] == answers[Stage.NORMAL][30, 50].tolist()
    assert [shown[f"radiance.{channel}"] for channel in "RGB"] == answers[Stage.RADIANCE][30, 50].tolist()


def test_a_scene_file_can_be_probed_and_a_miss_is_infinitely_far(rayproof: Rayproof, tmp_path: Path) -> None:
    save_scene(select(["primitives/sphere"])[0].scene, tmp_path / "scene.json")

    ended = rayproof("probe", tmp_path / "scene.json", 0, 0, "--json", tmp_path / "pixel.json")

    assert ended.code == 0
    shown = json.loads((tmp_path / "pixel.json").read_text())["renderers"]["analytic"]
    assert shown["distance.V"] == "inf"
    assert shown["object.V"] == -1


CONTROLS = [name for name, formula in FORMULAS.items() if formula.kind == "control" and formula.slot == "sample"]


@pytest.mark.parametrize("formula", CONTROLS)
def test_a_formula_can_be_chosen(rayproof: Rayproof, formula: str) -> None:
    ended = rayproof("probe", "primitives/sphere", 48, 36, "--formula", formula)

    assert ended.code == 0
    assert f"tracer-float32/{formula.replace('/', '=')}" in ended.out


FAULTS = [name for name, formula in FORMULAS.items() if formula.kind == "fault" and formula.slot == "lambert"]


@pytest.mark.parametrize("fault", FAULTS)
def test_a_planted_fault_is_shouted_first(rayproof: Rayproof, tmp_path: Path, fault: str) -> None:
    ended = rayproof("probe", "primitives/sphere", 48, 36, "--formula", fault, "--json", tmp_path / "pixel.json")

    assert ended.out.startswith(f"PLANTED FAULT IN USE: {fault}")
    assert json.loads((tmp_path / "pixel.json").read_text())["faults"] == [fault]


# Rays at vertices of a mesh: rounding decides which of the faces there is named.
VERTEX = ("watertight/vertices", 10, 0)


def test_a_pixel_over_its_limit_shows_the_nearby_answers(rayproof: Rayproof, tmp_path: Path) -> None:
    ended = rayproof("probe", *VERTEX, "--json", tmp_path / "pixel.json")

    found = json.loads((tmp_path / "pixel.json").read_text())["over_limit"]["tracer-float32"]
    assert found["problems"] == sum(found["objects"].values()) > 1
    assert len(found["objects"]) > 1
    assert all(name.startswith("shapes[0] (mesh) face ") for name in found["objects"])
    radiance = found["stages"]["radiance"]
    assert radiance["verdict"] == "explained by rounding"
    assert radiance["error"] > radiance["limit"] > 0
    assert all(low < high for low, high in zip(radiance["least"], radiance["greatest"], strict=True))
    assert f"{found['problems']} nearby problems were asked; they hit" in ended.out
    assert "object: explained by rounding" in ended.out
    assert max(map(len, ended.out.splitlines())) <= 80


def test_a_wrong_value_is_shown_as_wrong(rayproof: Rayproof, tmp_path: Path) -> None:
    fault = "radiance/fault_no_pi"

    rayproof("probe", "primitives/sphere", 48, 36, "--formula", fault, "--json", tmp_path / "pixel.json")

    written = json.loads((tmp_path / "pixel.json").read_text())
    (found,) = (found for name, found in written["over_limit"].items() if name.startswith("tracer-float32"))
    assert found["stages"]["radiance"]["verdict"] == "wrong"
    assert found["stages"]["radiance"]["continued"] == "wrong"
    assert set(found["stages"]) == {"radiance"}
    assert "analytic" not in written["over_limit"]
