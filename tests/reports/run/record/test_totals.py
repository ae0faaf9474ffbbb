"""Ledgers add up or the run fails; coverage counts only what ran and was measured."""

import pytest

from rayproof.reports.results.outcomes import Outcome, exit_code, ledger
from rayproof.reports.run import totals
from rayproof.reports.run.totals import of


def check(**changed):
    return {
        "configuration": "float32",
        "reference": "analytic",
        "stage": "distance",
        "verdict": "pass",
        "ratio": 0.5,
    } | changed


def record(**changed):
    return {
        "name": "family/case",
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
    assert of([record(checks=[check(verdict="missing")])]).coverage["HIT-1"]["cases"] == 0
    assert of([record(checks=[check(verdict="fail", ratio="inf")])]).coverage["HIT-1"]["failed"] == 1


@pytest.mark.parametrize(("ratio", "listed"), [(0.001, 1), (0.5, 0), (0.9, 1)])
def test_slack_and_tight_limits_are_listed_for_review(ratio, listed):
    assert len(of([record(checks=[check(ratio=ratio)])]).review) == listed


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


def test_a_required_reference_that_measured_nothing_is_named():
    checks = [check(reference="povray"), check(reference="tachyon", verdict="unsupported")]

    assert of([record(checks=checks)]).silent(("povray", "tachyon", "cycles")) == ("tachyon", "cycles")


def test_of_many_tight_limits_the_tightest_are_listed_in_the_order_of_all(monkeypatch):
    ratios = [0.8 + (17 * number % 101) / 1000 for number in range(1, 101)]
    records = [record(name=f"family/{number}", checks=[check(ratio=ratio)]) for number, ratio in enumerate(ratios)]
    everything = of(records).review
    monkeypatch.setattr(totals, "LISTED", 7)

    assert of(records).review == everything[:7]
