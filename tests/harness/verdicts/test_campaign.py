"""A campaign judges scenes drawn at random and counts the verdicts that certified arithmetic contradicts."""

# pyright: reportArgumentType=false
# Records are incomplete on purpose.

import json
from pathlib import Path

import pytest

from rayproof.cases.random_scenes import random_case
from rayproof.reports.subjects import PROGRAM, Subject
from tests.command_line import Command
from tests.harness.verdicts.__main__ import verdicts
from tests.harness.verdicts.campaign import SCENES, Tally
from tests.harness.verdicts.trials import fault_for, trials


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


@pytest.mark.parametrize(
    ("words", "said"), [(("--count", 0), "--count must be from 1"), (("--seed", -1), "--seed must be from 0")]
)
def test_what_cannot_be_drawn_is_refused_in_one_line(command: Command, words: tuple[object, ...], said: str) -> None:
    ended = command(verdicts, *words)

    assert (ended.code, ended.error.count("\n")) == (2, 1)
    assert said in ended.error


def test_each_tenth_scene_has_a_fault_that_concerns_it() -> None:
    cases = [random_case(4, number) for number in range(60)]
    faults = {case.name: fault for case in cases if (fault := fault_for(case)) is not None}

    assert {name.rpartition("/")[2] for name in faults} <= {str(number) for number in range(9, 60, 10)}
    assert len(faults) >= 5
    assert len({fault.name for fault in faults.values()}) >= 3
    assert all(
        set(fault.covers) & set(random_case(4, int(name.split("/")[2])).covers) for name, fault in faults.items()
    )


def test_the_example_is_tried_on_each_fifth_scene() -> None:
    program = Subject(name=PROGRAM, transport=PROGRAM, title="exec:lecture")

    tried = [any(one.name == PROGRAM for one in trials(random_case(4, number), program)) for number in range(10)]

    assert tried == [True, False, False, False, False] * 2


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
