"""`rayproof stability` tells what was measured, and its exit code whether it was what the catalogue says."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from rayproof.cases.ladders import PredictedSlope, all_ladders
from rayproof.reports.studies.stability import survey
from tests.reports.commands.conftest import Rayproof

KEYS = {
    "ladder",
    "formula",
    "precision",
    "slope",
    "slope_interval",
    "slope_predicted",
    "breakpoint",
    "worst_error_over_Ku",
    "false_hits",
    "false_misses",
    "expected",
    "verdict",
}
FAR = ("--quick", "SPH-FAR", "--precision", "float32")


def test_what_the_file_holds(rayproof: Rayproof, tmp_path: Path) -> None:
    ended = rayproof("stability", "sphere/textbook", "sphere/haines", *FAR, "--json", tmp_path / "out.json")

    assert ended.code == 0
    content = json.loads((tmp_path / "out.json").read_text())
    assert content["surprises"] == 0
    assert {one["formula"]: one["verdict"] for one in content["ladders"]} == {
        "sphere/haines": "pass",
        "sphere/textbook": "fail",
    }
    assert all(one.keys() >= KEYS for one in content["ladders"])


def test_a_wrong_prediction_is_a_surprise(rayproof: Rayproof, monkeypatch: pytest.MonkeyPatch) -> None:
    far = next(ladder for ladder in all_ladders() if ladder.name == "SPH-FAR")
    wrong = replace(far, slopes=(PredictedSlope(formulas=("*",), slope=3.0, because="a test says so"),))
    monkeypatch.setattr(survey, "all_ladders", lambda: (wrong,))

    ended = rayproof("stability", "sphere/haines", *FAR)

    assert ended.code == 1
    assert "SURPRISE" in ended.out
    assert "a test says so" in ended.out
