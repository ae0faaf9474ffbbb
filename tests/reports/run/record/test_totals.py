"""Ledgers add up or the run fails; coverage counts only what ran and was measured."""

from typing import Any

import pytest
from msgspec.structs import replace

from rayproof.cases.families import select
from rayproof.cases.stages import IMAGE_STAGES
from rayproof.reference.analytic import Analytic
from rayproof.reports.results.outcomes import Outcome, exit_code, ledger
from rayproof.reports.run.case_record import DECLARABLE, kinds_of
from rayproof.reports.run.totals import of
from tests.reports.checks import recorded


def check(**changed):
    known = {"configuration": "float32", "reference": "analytic", "stage": "distance", "verdict": "pass", "ratio": 0.5}
    return recorded(**(known | changed))


def record(**changed):
    return {
        "name": "family/case",
        "family": "family",
        "verdict": "pass",
        "covers": ["HIT-1", "RAD-2"],
        "planned": 1,
        "ran": {"float32": ["HIT-1", "RAD-2"]},
        "checks": [check()],
    } | changed


def test_a_lost_check_fails_the_ledger():
    with pytest.raises(ValueError, match="planned 2 but 1"):
        of([record(planned=2)]).check_ledger()


def test_cases_that_were_not_reached_are_missing():
    counts = of([record()]).case_ledger(planned=3)

    assert counts["planned"] == 3 == sum(count for name, count in counts.items() if name != "planned")
    assert counts["missing"] == 2
    assert of([record()]).verdict(planned=3) is Outcome.MISSING


def test_more_outcomes_than_planned_are_an_error_too():
    with pytest.raises(ValueError, match="planned 1 but 2"):
        ledger([Outcome.PASS, Outcome.PASS], planned=1)


def test_an_item_is_covered_only_by_a_measured_check_of_a_formula_that_ran():
    assert of([record()]).coverage["HIT-1"]["cases"] == 1
    assert of([record()]).coverage["RAD-2"]["cases"] == 0, "no radiometric stage was checked"
    assert of([record(ran={"float32": []})]).coverage["HIT-1"]["cases"] == 0
    for unmeasured in ("missing", "undecided", "unsupported", "error"):
        assert of([record(checks=[check(verdict=unmeasured)])]).coverage["HIT-1"]["cases"] == 0, unmeasured
    assert of([record(checks=[check(verdict="fail", ratio="inf")])]).coverage["HIT-1"]["failed"] == 1


@pytest.mark.parametrize(
    ("outcomes", "code"),
    [
        (["pass", "warn"], 0),
        (["pass", "fail", "error"], 1),
        (["reference_suspect"], 1),
        (["pass", "error"], 3),
        (["pass", "missing"], 3),
        (["unsupported"], 3),
        (["pass", "undecided"], 0),
        (["undecided"], 3),
        ([], 3),
    ],
)
def test_the_exit_code_says_what_happened(outcomes, code):
    assert exit_code(Outcome(outcome) for outcome in outcomes) == code


@pytest.mark.parametrize(("item", "stage", "covered"), [("HIT-1", "distance", 1), ("RAD-2", "irradiance", 0)])
def test_where_nothing_is_hit_misses_are_measured_and_light_is_not(item, stage, covered):
    empty = record(checks=[check(stage=stage, end_to_end={"interior": 0})])
    full = record(checks=[check(stage=stage, end_to_end={"interior": 9})])

    assert of([empty]).coverage[item]["cases"] == covered
    assert of([full]).coverage[item]["cases"] == 1


BLOCKED, CUBE = "with a blocked light", f"{DECLARABLE}with a cube"


def answering(number: int, kinds: list[str], *, without: tuple[str, ...] = (), refused: bool = False) -> list[Any]:
    """Return so many cases of a kind of a program that writes two stages, `without` some."""
    checks = [
        check(configuration="exec", stage=stage, verdict="unsupported" if refused or stage in without else "pass")
        for stage in ("camera", "normal", "visibility")
    ]
    checks[0] = replace(checks[0], outcome=Outcome.UNSUPPORTED)  # for which the protocol has no channel
    return [record(checks=checks, kinds=kinds, refused=refused, planned=3) for _ in range(number)]


BOTH = ("normal", "visibility")


@pytest.mark.parametrize(
    ("cases", "said"),
    [
        (answering(12, [BLOCKED]) + answering(5, []), []),
        (
            answering(3, [BLOCKED]) + answering(9, [BLOCKED], without=("visibility",)) + answering(5, []),
            ["leaves out visibility in 9 of the 12 cases with a blocked light"],
        ),
        (
            answering(4, [BLOCKED], without=("visibility",)) + answering(5, []),
            ["leaves out visibility in all 4 cases with a blocked light"],
        ),
        (answering(11, [], without=BOTH) + answering(2, []), ["answers nothing in 11 of the 13 cases"]),
        # It draws no cubes, and says so by its exit code or beforehand; or it never writes a stage.
        (answering(4, [CUBE], without=BOTH) + answering(5, []), []),
        (answering(4, [CUBE], refused=True) + answering(5, [CUBE]), []),
        (answering(9, [BLOCKED], without=("visibility",)), []),
        (answering(2, [CUBE], without=BOTH) + answering(3, [CUBE]), ["answers nothing in 2 of the 5 cases"]),
    ],
    ids=["all", "in part", "where a light is blocked", "hardly any", "a shape", "refused", "a stage", "some cubes"],
)
def test_what_is_left_out_of_cases_of_a_kind_is_named(cases: list[Any], said: list[str]) -> None:
    assert of(cases).answered["left_out"] == said


@pytest.mark.parametrize(
    ("name", "kinds"),
    [
        ("shadows/every_blocker", {BLOCKED, CUBE, f"{DECLARABLE}with a square"}),
        ("primitives/sphere", {f"{DECLARABLE}with a sphere"}),
    ],
)
def test_the_kinds_of_a_case_name_its_shapes_and_whether_a_light_is_blocked(name: str, kinds: set[str]) -> None:
    (case,) = select((name,))

    found = {*kinds_of(case.scene, Analytic().render(case.scene, IMAGE_STAGES))}

    assert kinds <= found
    assert (BLOCKED in found) == (BLOCKED in kinds)


def test_the_share_that_was_answered_leaves_out_what_the_protocol_does() -> None:
    answered = of(answering(2, [], without=("visibility",)) + answering(1, [])).answered

    assert (answered["checks"], answered["planned"], answered["stages"]) == (4, 6, ["normal", "visibility"])
    assert answered["families"] == {"family": (4, 6)}


def test_a_check_without_a_witness_was_answered_if_the_stage_is_measured_elsewhere() -> None:
    abstains = check(reference="radiance", verdict="undecided")

    assert of([record(checks=[check(), abstains], planned=2)]).answered["checks"] == 2
    crashed = [check(verdict="error"), abstains]
    assert of([record(checks=crashed, planned=2)]).answered["checks"] == 0
