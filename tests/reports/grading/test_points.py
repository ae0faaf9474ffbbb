"""Each mistake costs its own item: by proven mistakes, by stages, by what explains most; the rest is left open."""

from pathlib import Path
from typing import Any, cast

import pytest

from rayproof.reports.diagnosis.diagnosing import CHANGING
from rayproof.reports.grading.points import State, grades, own_items
from rayproof.reports.grading.rubric import Rubric, load_rubric
from rayproof.reports.results.records import RunRecord
from tests.reports.checks import recorded

STAGES = ("ray", "object", "distance", "position", "normal", "visibility", "irradiance", "exitance", "radiance")
CASES = ("primitives/sphere", "primitives/cube", "combined/01_sphere_turned", "combined/03_cube_sheared")


@pytest.fixture
def rubric(tmp_path: Path) -> Rubric:
    items = ("CAM-1", "HIT-1", "HIT-3", "XF-1", "NRM-3", "RAD-1", "RAD-4", "IMG-1")
    points = ", ".join(f"{item} = 1" for item in items)
    names = ", ".join(f'"{name}"' for name in CASES)
    (tmp_path / "rubric.toml").write_text(
        f'title = "A course"\npoints = {{{points}}}\n[program]\nrun = "a {{scene}} {{output}}"\n'
        f"[cases]\nvisible = [{names}]\n"
    )
    return load_rubric(tmp_path / "rubric.toml")


def record(rubric: Rubric, name: str, verdict: str, *alone: str, written: tuple[str, ...] = STAGES, **more: Any) -> Any:
    """Return a case's record in which some stages are wrong by themselves."""
    case = next(case for case in rubric.cases if case.name == name)
    checks = [
        recorded(
            configuration="exec",
            reference="analytic",
            stage=stage,
            verdict="fail" if stage in alone else "pass" if stage in written else "unsupported",
            continued={"worst_ratio": 9.0 if stage in alone else 0.1},
        )
        for stage in STAGES
    ]
    facts = {"name": name, "verdict": verdict, "covers": list(case.covers), "checks": checks, "stage": None}
    shapes = [type(shape).__name__ for shape in case.scene.shapes]
    return facts | {"shapes": shapes, "stage": alone[0] if alone else None} | more


def states(rubric: Rubric, *records: Any, diagnosis: Any = ()) -> dict[str, State]:
    """Return the state of each item that is not earned; cases that are not given pass."""
    given = {one["name"] for one in records}
    rest = [record(rubric, name, "pass") for name in CASES if name not in given]
    results = cast(RunRecord, {"cases": [*records, *rest], "diagnosis": list(diagnosis)})
    return {grade.item: grade.state for grade in grades(results, rubric) if grade.state is not State.EARNED}


def test_a_right_program_earns_everything(rubric: Rubric) -> None:
    assert states(rubric) == {}


def test_two_mistakes_in_one_case_cost_an_item_each(rubric: Rubric) -> None:
    first = record(rubric, CASES[0], "fail", "distance", "radiance", blamed_items=["HIT-1"])
    second = record(rubric, CASES[2], "fail", "distance", blamed_items=["HIT-1", "XF-1"])
    assert states(rubric, first, second) == {"HIT-1": State.WRONG, "RAD-4": State.WRONG}


def test_what_cannot_be_told_apart_is_left_open(rubric: Rubric) -> None:
    unsure = record(rubric, CASES[2], "fail", "distance", blamed_items=["HIT-1", "XF-1"])
    rest = [record(rubric, name, "error", reason="it crashed") for name in (CASES[0], CASES[1], CASES[3])]
    found = states(rubric, unsure, *rest)
    assert (found["HIT-1"], found["XF-1"]) == (State.UNDECIDED, State.UNDECIDED)


def test_a_proven_mistake_costs_its_item_and_the_rest_counts_as_right_under_it(rubric: Rubric) -> None:
    failing = [record(rubric, name, "fail", "radiance", written=("radiance",)) for name in CASES]
    cause = {
        "mistake": "no_pi",
        "items": ["RAD-4"],
        "sentence": "The renderer leaves out 1/pi [RAD-4 x]: this explains 4 of 4 failing cases.",
        "cases": list(CASES),
        "alternatives": [],
    }
    assert states(rubric, *failing, diagnosis=[cause]) == {"RAD-4": State.WRONG}


def test_by_radiance_alone_nothing_is_charged_where_one_item_does_not_explain_all(rubric: Rubric) -> None:
    first = record(rubric, CASES[0], "fail", "radiance", written=("radiance",), blamed_items=["HIT-1", "RAD-1"])
    second = record(rubric, CASES[1], "fail", "radiance", written=("radiance",), blamed_items=["HIT-3", "CAM-1"])
    rest = [record(rubric, name, "pass", written=("radiance",)) for name in CASES[2:]]
    assert set(states(rubric, first, second, *rest).values()) == {State.UNDECIDED}


def test_by_radiance_alone_what_fails_in_most_of_its_cases_is_left_open(rubric: Rubric) -> None:
    blamed = ["HIT-3", "CAM-1"]  # wrong are both cubes, and two of four images
    cubes = [record(rubric, CASES[k], "fail", "radiance", written=("radiance",), blamed_items=blamed) for k in (1, 3)]
    spheres = [record(rubric, CASES[k], "pass", written=("radiance",)) for k in (0, 2)]
    found = states(rubric, *cubes, *spheres)
    assert found["HIT-3"] is State.UNDECIDED
    assert "CAM-1" not in found


@pytest.mark.parametrize("verdict", ["error", "unsupported", "missing"])
def test_without_an_answer_nothing_is_earned_by_it(rubric: Rubric, verdict: str) -> None:
    cubes = [record(rubric, CASES[k], verdict, reason="it says no") for k in (1, 3)]
    found = states(rubric, *cubes)
    assert found["HIT-3"] == verdict
    assert "RAD-4" not in found
    everything = [record(rubric, name, verdict) for name in CASES]
    assert set(states(rubric, *everything).values()) == {State(verdict)}


def test_images_that_change_cost_their_storing_and_excuse_nothing(rubric: Rubric) -> None:
    again = [{"verdict": "fail", "stage": "radiance"}]
    twice = record(rubric, CASES[0], "fail", "distance", blamed_items=["HIT-1"], repeated=again)
    cause = {"mistake": CHANGING, "items": ["IMG-1"], "sentence": "It changes.", "cases": list(CASES)}
    assert states(rubric, twice, diagnosis=[cause]) == {"IMG-1": State.WRONG, "HIT-1": State.WRONG}


def test_a_camera_that_was_fitted_costs_what_it_differs_in() -> None:
    items = ("CAM-1", "CAM-2", "CAM-3", "CAM-4", "CAM-5")
    assert own_items("another_camera", items, "whose image is 1.2 times as wide") == ("CAM-2",)
    assert own_items("another_camera", items, "whose image is turned by 1 degrees about the right axis") == ("CAM-1",)
    assert own_items("another_camera", items, "n/(n - 1) of n pixels times as wide") == ("CAM-3",)
    assert own_items("acne", ("LIT-2", "LIT-3"), "") == ("LIT-1",)


def test_one_case_in_which_an_earlier_stage_is_wrong_costs_no_second_item(rubric: Rubric) -> None:
    first = record(rubric, CASES[3], "fail", "normal", "visibility", blamed_items=["NRM-3"])
    assert states(rubric, first) == {"NRM-3": State.WRONG}
