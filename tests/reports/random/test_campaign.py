"""`rayproof run random` judges scenes drawn at random and counts the verdicts that certified arithmetic contradicts."""

import json
from pathlib import Path

import pytest

from rayproof.cases.random_scenes import FAMILY, random_case
from rayproof.reports.random import campaign
from rayproof.reports.random.campaign import Tally
from rayproof.reports.random.trials import fault_for, trials
from rayproof.reports.subjects import PROGRAM, Subject
from tests.reports.commands.conftest import Rayproof


@pytest.mark.process
def test_a_run_of_random_scenes_counts_wrong_verdicts(rayproof: Rayproof, tmp_path: Path) -> None:
    out, record = tmp_path / "out", tmp_path / "results.json"

    ended = rayproof("run", FAMILY, "--count", 1, "--seed", 1, "--out", out, "--json", record)

    found = json.loads(record.read_text())
    assert [case["name"] for case in found["cases"]] == ["random/1/0"]
    assert (ended.code, found["wrong_verdicts"], found["undecided"]["share"]) == (0, [], 0.0)
    assert found["features"] == json.loads((out / "random.json").read_text())["features"]
    assert sum(found["features"].values()) > 2
    assert (out / "scenes" / "random" / "1" / "0.json").is_file()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("random", "--count", 0), "--count must be from 1"),
        (("random", "--seed", -1), "--seed must be from 0"),
        (("primitives", "--count", 3), "rayproof run random --count N --seed S"),
        (("random", "primitives"), "run by itself"),
        (("random/1",), "random/SEED/NUMBER"),
    ],
)
def test_what_cannot_be_drawn_is_refused_in_one_line(rayproof: Rayproof, words: tuple[object, ...], said: str) -> None:
    ended = rayproof("run", *words)

    assert ended.code == 2
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
    program = Subject(name=PROGRAM, title="exec:lecture")

    tried = [any(one.name == PROGRAM for one in trials(random_case(4, number), program)) for number in range(10)]

    assert tried == [True, False, False, False, False] * 2


def test_one_wrong_verdict_or_too_many_undecided_scenes_are_no_sound_run() -> None:
    sound = Tally(seed=1, scenes=[f"random/1/{number}" for number in range(100)], undecided={"random/1/3": ["float32"]})
    wrong = Tally(seed=1, scenes=sound.scenes, wrong=[{"case": "random/1/1"}])
    open_ = Tally(seed=1, scenes=sound.scenes, undecided={name: ["float32"] for name in sound.scenes[:2]})

    assert (sound.sound, wrong.sound, open_.sound) == (True, False, False)


def test_a_scene_that_a_time_limit_stopped_is_counted_as_such_and_not_as_undecided(monkeypatch, tmp_path) -> None:
    certified = {"wrong": [], "undecided": [], "undecidable": [], "abstained": [], "stopped": ["radiance"], "why": None}
    cases = [
        {"name": "random/1/0", "certified": [certified]},
        {"name": "random/1/1", "verdict": "error", "reason": "judging failed", "stopped": ["the judge"]},
        {"name": "random/1/2", "verdict": "error", "reason": "judging failed"},
    ]
    monkeypatch.setattr(campaign, "load_results", lambda folder: {"cases": cases})
    tally = Tally(seed=1)

    tally.add(tmp_path)

    assert tally.stopped == {"random/1/0": ["radiance"], "random/1/1": ["the judge"]}
    assert (tally.undecided, tally.abstained) == ({"random/1/2": ["not judged: judging failed"]}, {})
    assert tally.as_json()["undecided"]["stopped"] == tally.stopped
