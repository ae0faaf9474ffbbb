"""The speed of `certified` is measured on any scene, and where it cannot answer it says why."""

import dataclasses
import json
from pathlib import Path

import pytest

from rayproof.cases.families import select
from rayproof.cases.scene_json import save_scene
from tests.benchmarks.bench.oracle_speed import oracle_speed
from tests.command_line import Command


@pytest.mark.process
def test_the_speed_is_measured(command: Command, tmp_path: Path) -> None:
    scene = select(["primitives/sphere"])[0].scene
    small = dataclasses.replace(scene, camera=dataclasses.replace(scene.camera, width=12, height=9))
    save_scene(small, tmp_path / "small.json")

    ended = command(oracle_speed, tmp_path / "small.json", "--json", tmp_path / "speed.json")

    assert ended.code == 0
    speeds = json.loads((tmp_path / "speed.json").read_text())["speeds"]
    assert {name: one["pixels"] for name, one in speeds.items()} == {
        "certified": 108,
        "certified, two processes": 216,
    }
    assert all(one["pixels_per_second"] > 0 and one["pixels_per_processor_second"] > 0 for one in speeds.values())


def test_the_speed_of_what_a_truth_cannot_answer_is_a_sentence(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rayproof.reference.certified.MOST_SURFACES", 0)

    ended = command(oracle_speed, "primitives/sphere", "--json", tmp_path / "speed.json")

    assert ended.code == 0
    speeds = json.loads((tmp_path / "speed.json").read_text())["speeds"]
    assert "too long to certify" in speeds["certified"]["unsupported"]
