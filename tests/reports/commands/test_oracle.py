"""`rayproof certify` encloses what every other renderer should have answered."""

import json
from pathlib import Path

import pytest

from rayproof.cases.families import select
from rayproof.cases.scene_json import save_scene
from rayproof.cases.stages import IMAGE_STAGES
from rayproof.reference import REFERENCES
from tests.reports.commands.conftest import Rayproof


def test_a_rectangle_of_a_scene_file(rayproof: Rayproof, tmp_path: Path) -> None:
    scene = select(["primitives/sphere"])[0].scene
    save_scene(scene, tmp_path / "scene.json")

    file = tmp_path / "out" / "o.json"
    ended = rayproof("certify", tmp_path / "scene.json", "--pixels", "40,30,43,32", "--json", file)

    assert ended.code == 0
    assert "undecided: none" in ended.out
    written = json.loads((tmp_path / "out" / "o.json").read_text())
    assert [one["pixel"] for one in written["pixels"]] == [[x, y] for y in range(30, 33) for x in range(40, 44)]
    assert written["undecided"] == []
    analytic = REFERENCES["analytic"]().render(scene, IMAGE_STAGES)
    for record in written["pixels"]:
        x, y = record["pixel"]
        assert record["bits"] >= 128
        for stage in IMAGE_STAGES:
            assert len(record["stages"][stage]) == len(written["channels"][stage])
            for (low, high), value in zip(record["stages"][stage], analytic[stage][y, x], strict=True):
                assert float(low) <= float(high)
                assert float(low) == pytest.approx(value, rel=1e-12)
                assert float(high) == pytest.approx(value, rel=1e-12)


def test_one_pixel_is_shown_and_stages_can_be_chosen(rayproof: Rayproof, tmp_path: Path) -> None:
    asked = ("--stages", "distance,object", "--json", tmp_path / "o.json")
    ended = rayproof("certify", "primitives/cube", "--pixels", "0,0", *asked)

    assert ended.code == 0
    assert "distance.V" in ended.out
    (record,) = json.loads((tmp_path / "o.json").read_text())["pixels"]
    assert record["stages"] == {"object": [[-1, -1], [-1, -1]], "distance": [["inf", "inf"]]}
