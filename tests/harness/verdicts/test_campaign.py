"""A campaign judges scenes drawn at random and counts the verdicts that certified arithmetic contradicts."""

# pyright: reportArgumentType=false
# Records are incomplete on purpose.

import json
from pathlib import Path

import pytest

from tests.command_line import Command
from tests.harness.verdicts.__main__ import verdicts
from tests.harness.verdicts.campaign import SCENES, Tally


@pytest.mark.process
def test_a_campaign_counts_wrong_verdicts_and_goes_on(command: Command, tmp_path: Path) -> None:
    out, copy = tmp_path / "out", tmp_path / "copy.json"

    ended = command(verdicts, "--count", 1, "--seed", 1, "--out", out, "--json", copy)

    found = json.loads(copy.read_text())
    assert (ended.code, found["scenes"], found["wrong_verdicts"]) == (0, 1, [])
    assert found["undecided"]["share"] == 0
    assert found == json.loads((out / "verdicts.json").read_text())
    assert sum(found["features"].values()) > 2
    lines = (out / SCENES).read_text().splitlines()
    assert [json.loads(line)["case"] for line in lines] == ["random/1/0"]

    # What is known is not judged again: a verdict that is put there by hand stays.
    known = json.loads(lines[0])
    known["certified"][0]["wrong"] = [{"case": "random/1/0", "configuration": "float32", "stage": "ray", "why": "hand"}]
    known["certified"][0]["wrong"][0] |= {"pixel": None, "verdict": "pass"}
    (out / SCENES).write_text(json.dumps(known) + "\n")
    ended = command(verdicts, "--count", 1, "--seed", 1, "--out", out, "--resume")

    assert ended.code == 1
    assert "wrong: random/1/0 float32 ray: pass: hand" in ended.out


def test_one_wrong_verdict_or_too_many_undecided_scenes_are_no_sound_run() -> None:
    sound = Tally(seed=1, scenes=[f"random/1/{number}" for number in range(100)], undecided={"random/1/3": ["float32"]})
    wrong = Tally(seed=1, scenes=sound.scenes, wrong=[{"case": "random/1/1"}])
    open_ = Tally(seed=1, scenes=sound.scenes, undecided={name: ["float32"] for name in sound.scenes[:2]})

    assert (sound.sound, wrong.sound, open_.sound) == (True, False, False)


def test_a_scene_that_a_time_limit_stopped_is_counted_as_such_and_not_as_undecided() -> None:
    certified = {"wrong": [], "undecided": [], "undecidable": [], "abstained": [], "stopped": ["radiance"], "why": None}
    tally = Tally(seed=1)

    tally.add({"case": "random/1/0", "subject": "tracer", "certified": [certified]})
    tally.add({"case": "random/1/1", "subject": "tracer", "error": "no answer within 9 s", "stopped": True})
    tally.add({"case": "random/1/2", "subject": "tracer", "error": "it died", "stopped": False})

    assert tally.stopped == {"random/1/0": ["radiance"], "random/1/1": ["not judged: no answer within 9 s"]}
    assert (tally.undecided, tally.abstained) == ({"random/1/2": ["not judged: it died"]}, {})
    assert tally.as_json()["undecided"]["stopped"] == tally.stopped


def test_a_lie_that_nobody_sees_is_a_wrong_verdict() -> None:
    lie = {"case": "random/1/9", "pixels": 40, "unseen": 2, "wide": 0, "epsilon": 0}
    lie["holes"] = ["random/1/9: distance at (1, 2)"]
    tally = Tally(seed=1)

    tally.add({"case": "random/1/9", "subject": "tracer", "certified": [], "lie": lie})

    (wrong,) = tally.wrong
    assert (wrong["configuration"], wrong["stage"]) == ("liar", "distance")
    assert tally.liar == {"pixels": 40, "unseen": 2, "wide": 0, "epsilon": 0}
