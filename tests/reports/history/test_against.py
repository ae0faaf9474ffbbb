"""Held against an earlier run: what became worse is red, what fails as before is let through and named."""

from typing import Any

import pytest

from rayproof.reports.history.expectations import KnownFailures
from rayproof.reports.history.gating import Base, Demanded, coverage, held, standing
from tests.reports.history.test_gating import ENTRY, TODAY, check, run

FIRST, LAST = "8" + "0" * 15, "0" * 15 + "1"
WRONG, MORE = (run(check(ratio=float("inf"), examined={"wrong": count})) for count in (400, 11_998))


def against(earlier: dict[str, Any]) -> Demanded:
    """Demand that a run is no worse than an earlier one."""
    return Demanded(against=Base(name="before", results=earlier))


def test_what_fails_as_before_is_let_through_and_named():
    found = held(run(check()), against(run(check())))

    assert not found.red
    assert found.cases == ["shadows/one"]
    assert found.matched == ["shadows/one: float32 analytic distance: fail, as in before"]


@pytest.mark.parametrize(
    ("now", "before", "said"),
    [
        (run(check(ratio=3.4)), run(check()), "error over limit 3.4, was 3"),
        (run(check()), run(check(verdict="warn"), verdict="warn"), "fail, was warn"),
        (run(check(ratio=0.5, verdict="pass")), run(check(ratio=0.001, verdict="pass")), "limit 0.5, was 0.001"),
        (run(check(verdict="error")), run(check()), "error, was fail"),
        (run(check(verdict="missing")), run(check()), "missing, was fail"),
        (run(check(), check(stage="normal", verdict="missing")), run(check()), "missing, and was not made before"),
        (run(check(), check(stage="normal")), run(check()), "fail, and was not made before"),
        (run(check()), run(check(), check(stage="normal", verdict="pass")), "is not made any more"),
        (run(check(), name="shadows/three"), run(check()), "before does not have it"),
        (run(verdict="error"), run(verdict="pass"), "error, was pass"),
        (run(check(verdict="undecided"), verdict="undecided"), run(check()), "undecided, was fail"),
        (run(check(verdict="unsupported"), verdict="unsupported"), run(check()), "unsupported, was fail"),
        (MORE, WRONG, "wrong pixels 11998, was 400"),
        (run(check(end_to_end={"mean_wrong": 4})), run(check(end_to_end={"mean_wrong": 2})), "wrong pixels 4, was 2"),
        (run(check(end_to_end={"nan": 3})), run(check()), "pixels without a finite number 3, was 0"),
        (run(check(cells=[FIRST, FIRST])), run(check(cells=[LAST, LAST])), "wrong in 1 of 64 parts"),
    ],
    ids=[
        "error", "verdict", "from nothing", "crash", "no answer", "new check without answer", "new check",
        "lost check", "new case", "no checks", "undecided", "unsupported", "more pixels", "larger error", "NaN",
        "elsewhere",
    ],
)  # fmt: skip
def test_whatever_became_worse_is_red(now: dict[str, Any], before: dict[str, Any], said: str):
    found = held(now, against(before))

    assert found.red
    assert said in found.worse[0]
    assert found.cases == []


def test_a_run_that_is_not_finished_is_red():
    assert held(run(check(), finished=False), against(run(check()))).red


def test_what_became_better_or_a_tenth_worse_is_not_red():
    for now in (run(check(ratio=0.5, verdict="pass"), verdict="pass"), run(check(ratio=3.2))):
        assert standing(now, Base(name="before", results=run(check()))).worse == []
    next_to_nothing = run(check(ratio=0.001, verdict="pass"))
    now = run(check(ratio=0.009, verdict="pass"))
    assert standing(now, Base(name="before", results=next_to_nothing)).worse == []


def test_expected_and_worse_than_before_is_red():
    before = run(check(verdict="pass"), verdict="pass")
    demanded = Demanded(
        expected=("known.json", KnownFailures(expected=(ENTRY,))), against=Base(name="before", results=before)
    )

    found = held(run(check()), demanded, today=TODAY)

    assert (found.red, found.regressions, len(found.worse)) == (True, [], 1)
    assert found.sentence == "The gate known.json, against before is red: 1 new."


def test_too_little_coverage_is_red_whatever_passes():
    results = {**run(check(verdict="pass"), verdict="pass"), "answered": {"cases": 3, "planned_cases": 4}}

    assert coverage(results)[0] == 75
    assert not held(results, Demanded(least_coverage=75)).red
    found = held(results, Demanded(least_coverage=76))
    assert found.uncovered == ["3 of 4 cases (75.0 %) were answered, and 76 % are demanded"]
    assert found.red
    assert held({**results, "answered": {}}, Demanded(least_coverage=1)).red
