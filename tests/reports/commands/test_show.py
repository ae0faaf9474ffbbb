"""`rayproof show` tells what a case asks, and how to ask it again."""

import json
from pathlib import Path

import pytest

from rayproof.cases.families import all_cases
from rayproof.cases.scene_json import scene_to_json
from tests.reports.commands.conftest import Rayproof


@pytest.mark.parametrize("case", all_cases(), ids=lambda case: case.name)
def test_show_tells_scene_requirements_and_how_to_reproduce(rayproof: Rayproof, case) -> None:
    ended = rayproof("show", case.name)

    assert ended.code == 0
    assert case.stresses in ended.out
    assert f"rayproof run {case.name}" in ended.out
    assert f">= {case.least_interior}" in ended.out
    assert all(item in ended.out for item in case.covers)


def test_show_writes_the_whole_scene(rayproof: Rayproof, tmp_path: Path) -> None:
    case = all_cases()[0]

    rayproof("show", case.name, "--json", tmp_path / "case.json")

    written = json.loads((tmp_path / "case.json").read_text())
    assert written["scene"] == json.loads(json.dumps(scene_to_json(case.scene)))
    assert written["covers"] == list(case.covers)
