"""A small trade-off measured in earnest: its data, its pictures and its page."""

import csv
import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from rayproof.cases.families import select
from rayproof.reports.publish.page.page import diagrams
from rayproof.reports.studies.tradeoff import diagrams as listed
from rayproof.reports.studies.tradeoff.diagrams import measure, overall, tasks
from rayproof.reports.studies.tradeoff.drawing import write
from rayproof.reports.studies.tradeoff.points import TradeoffPoint

POINT = TradeoffPoint(
    diagram="sphere/a", label="haines, float32", renderer="tracer", variant="haines", precision="float32", samples=1,
    kind="right", clock="kernels", error=1.0, error_interval=(1.0, 1.0), natural=1e-7, unit="m", wrong=0.0,
    nanoseconds=4.0, nanoseconds_interval=(3.0, 5.0),
)  # fmt: skip


@pytest.fixture(scope="module")
def result() -> dict[str, Any]:
    patch = pytest.MonkeyPatch()
    patch.setattr(listed, "PER_SIDE", (1, 2))
    patch.setattr(listed, "TRUTH_PER_SIDE", 8)
    patch.setattr(listed, "SAMPLES_TIMED", 2**10)
    patch.setattr(listed, "SAMPLES_WALL", 2**10)
    formulas, _, climbed = tasks(["grazing_plane", "far_sphere_1e3", "SPH-FAR"])
    sampled = ("antialiased", select(["antialiased/sphere"])[0].scene)
    found = measure(formulas, [sampled], climbed, repetitions=9, tell=lambda _: None)
    patch.undo()
    return found


def points(result: dict[str, Any], name: str) -> dict[str, dict[str, Any]]:
    """Return a diagram's points by label."""
    (diagram,) = (one for one in result["diagrams"] if one["name"] == name)
    return {point["label"]: point for point in diagram["points"]}


@pytest.mark.references
def test_every_point_has_a_time_and_an_error_inside_their_intervals(result: dict[str, Any]) -> None:
    found = [point for diagram in result["diagrams"] for point in diagram["points"]]

    assert len(found) > 20
    for point in found:
        assert 0 < point["nanoseconds_low"] <= point["nanoseconds"] <= point["nanoseconds_high"]
        assert 0 < point["error_low"] <= point["error"] <= point["error_high"]


@pytest.mark.references
def test_precision_and_formula_both_buy_digits(result: dict[str, Any]) -> None:
    far = points(result, "sphere/far_sphere_1e3")

    assert far["haines, float32"]["error"] < far["textbook, float32"]["error"] / 100
    assert far["textbook, float64"]["error"] < far["haines, float32"]["error"]
    assert far["textbook, float32"]["wrong"] > 0 == far["haines, float32"]["wrong"]
    assert "mitsuba_llvm, float32" in far


@pytest.mark.references
def test_a_ladder_parts_the_formulas_as_its_scenes_do(result: dict[str, Any]) -> None:
    far = points(result, "ladder/SPH-FAR")

    assert far["haines, float32"]["error"] <= 4 < far["textbook, float32"]["error"]
    assert far["textbook, float32"]["wrong"] > far["haines, float32"]["wrong"]


@pytest.mark.references
def test_more_samples_come_nearer_to_the_coverage_whoever_renders(result: dict[str, Any]) -> None:
    sampled = points(result, "samples/antialiased")

    for who in ("tracer, float32", "tracer, float64", "mitsuba_llvm, float32", "mitsuba_scalar, float32"):
        assert sampled[f"{who}, 4 per pixel"]["error"] < sampled[f"{who}, 1 per pixel"]["error"]


def test_a_mean_over_diagrams_does_not_drop_what_has_no_error() -> None:
    errors = {"sphere/a": math.nan, "sphere/b": 2.0}
    mine = [
        replace(POINT, diagram=name, error=error, error_interval=(error, error), wrong=float(math.isnan(error)))
        for name, error in errors.items()
    ]

    (mean,) = overall(mine, "sphere")

    assert math.isnan(mean.error)
    assert mean.wrong == 0.5


@pytest.mark.references
def test_the_folder_holds_data_pictures_and_a_page_without_scripts(result: dict[str, Any], tmp_path: Path) -> None:
    (tmp_path / "tradeoff").mkdir()
    (tmp_path / "tradeoff" / "stale.svg").touch()

    write(tmp_path, result)

    folder = tmp_path / "tradeoff"
    data = json.loads((folder / "tradeoff.json").read_text())
    assert data["diagrams"] == json.loads(json.dumps(result["diagrams"]))
    rows = list(csv.DictReader((folder / "tradeoff.csv").read_text().splitlines()))
    assert len(rows) == sum(len(diagram["points"]) for diagram in result["diagrams"])
    assert {path.name for path in folder.glob("*.svg")} == {diagram["svg"] for diagram in result["diagrams"]}
    text = (folder / "index.html").read_text()
    assert "<script" not in text
    assert "default-src &#x27;none&#x27;" in text or "default-src 'none'" in text
    assert all(f'src="{diagram["svg"]}"' in text for diagram in result["diagrams"])
    assert diagrams(tmp_path) == sorted(diagram["svg"] for diagram in result["diagrams"])
