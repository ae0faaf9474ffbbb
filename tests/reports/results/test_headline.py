"""What stands first in every publication, from records as docs/results.md has them."""

import math
from typing import Any

import pytest

from rayproof.reports.results.case_records import worst_ratio
from rayproof.reports.results.headline import failure_groups, headline, last_line, worse_by_cause
from rayproof.reports.results.outcomes import LEDGER
from tests.reports.checks import recorded

MEASURED = {"worst_ratio": 0.25}


@pytest.mark.parametrize(
    ("check", "ratio"),
    [
        ({"verdict": "pass", "ratio": 0.25, "end_to_end": MEASURED}, 0.25),
        ({"verdict": "pass", "ratio": 0.25}, 0.25),  # of the camera, which has no pixels to measure
        ({"verdict": "fail", "ratio": "nan"}, math.inf),
        ({"verdict": "error", "ratio": 0.25, "end_to_end": MEASURED}, 0.25),
        ({"verdict": "error", "ratio": 0.0, "reason": "it ended with exit code 3"}, None),
        ({"verdict": "missing", "ratio": 0.0, "end_to_end": None, "continued": None}, None),
        ({"verdict": "unsupported", "ratio": 0.0}, None),
    ],
)
def test_what_was_not_measured_has_no_error(check: dict[str, Any], ratio: float | None) -> None:
    assert worst_ratio({"checks": [recorded(**check)]}) == ratio


def test_what_became_worse_is_one_line_a_cause() -> None:
    entries = [
        {"case": name, "what": what, "factor": 2.0, "sentence": f"{name}: {what}"}
        for name, what in (("a/1", "verdict"), ("a/2", "verdict"), ("b/1", "verdict"), ("c/1", "time"), ("c/2", "time"))
    ]
    cases = [{"name": name, "verdict": "fail", "stage": "normal", "item": "NRM-1"} for name in ("a/1", "a/2", "b/1")]
    told = [{"sentence": "It leaves out 1/pi.", "cases": ["a/1", "a/2"]}]
    results: Any = {"cases": cases, "diagnosis": told, "history": {"worse": entries}}

    assert worse_by_cause(results) == [
        "a/1: verdict [It leaves out 1/pi.]; and 1 more case",
        "b/1: verdict [normal NRM-1]",
        "c/1: time; and 1 more case",
    ]


def run_of(outcome: str, **more: Any) -> Any:
    """Return a run of one case with an outcome."""
    counts = dict.fromkeys(LEDGER, 0) | {"planned": 1, outcome: 1}
    return {"verdict": outcome, "summary": counts, "checks": counts, "cases": [], **more}


GATE = {
    "file": "known.json", "sentence": "The gate known.json is green: 1 accepted.", "red": False, "cases": ["a/b"],
    "regressions": [], "tighten": [], "stale": [], "expired": [], "matched": ["a/b: 2 failing checks: a reason"],
}  # fmt: skip


def test_the_gate_comes_before_the_cases() -> None:
    green = run_of("fail", gate=GATE)
    red = run_of("pass", gate=GATE | {"red": True, "tighten": ["a/b: x passes now"], "cases": []})

    assert headline(green) == "The gate known.json is green: 1 accepted; 1 case: 1 fail."
    assert last_line(green) == "gate green; cases: fail"
    assert headline(red) == "The gate known.json is red: 1 mended; 1 case: all pass, in 1 check."
    assert last_line(red) == "gate red; cases: pass"


def test_the_share_that_was_answered_stands_in_headline_and_last_line() -> None:
    stages = ["ray"]
    little = run_of("pass", subject="exec:./mine", answered={"checks": 65, "planned": 511, "stages": stages})
    named = little | {"declared": {"name": "mine 1.2"}}
    wrong = run_of("fail", answered={"checks": 65, "planned": 511, "stages": ["ray", "object", "distance", "normal"]})

    assert headline(little) == "exec:./mine: 1 case passes on the 65 of 511 checks that it answers (ray only)."
    assert headline(named).startswith("mine 1.2: 1 case passes on the 65 of 511")
    assert last_line(little) == "pass; 65 of 511 checks answered (ray only)"
    assert "65 of 511 checks answered (without position, visibility" in headline(wrong)
    camera = little | {"checks": little["checks"] | {"planned": 529}}
    assert last_line(camera) == "pass; 65 of 511 checks of images answered (ray only)"
    assert last_line(run_of("pass", answered={"checks": 511, "planned": 511})) == "pass"


def failing(name: str, item: str | None, stage: str = "normal", verdict: str = "fail") -> dict[str, Any]:
    """Return the record of a case that fails at a stage, of which an item is blamed."""
    wrong = {"verdict": verdict, "stage": stage, "reference": "radiance", "configuration": "float32", "ratio": "inf"}
    measured = {"worst_ratio": "inf", "mean_wrong": 0.25}
    check = recorded(**wrong, examined={"pixels": 4800, "wrong": 12}, end_to_end=measured)
    return {"name": name, "verdict": verdict, "stage": stage, "item": item, "checks": [check]}


def test_the_largest_group_comes_first_with_the_names_of_its_items_in_one_sentence() -> None:
    cases = [failing("a/1", "LIT-5", "visibility"), *(failing(f"b/{k}", "NRM-3") for k in range(3)), failing("c", None)]
    counts = dict.fromkeys(LEDGER, 0) | {"planned": 9, "fail": 5, "pass": 4}
    results: Any = {"summary": counts, "checks": counts, "cases": cases}

    assert headline(results) == (
        "9 cases: 5 fail, 4 pass; normal NRM-3 (world normal by the inverse transpose) in 3 cases, "
        "normal in 1 case, visibility LIT-5 (against acne: offset along the normal) in 1 case."
    )
    assert [(group.count, group.names) for group in failure_groups(results)] == [
        (3, ["b/0", "b/1", "b/2"]),
        (1, ["c"]),
        (1, ["a/1"]),
    ]


def test_what_is_new_comes_before_what_is_accepted_and_what_is_mended() -> None:
    cases = [
        *(failing(f"old/{k}", "RAD-2", "irradiance") for k in range(5)),
        failing("new", "NRM-3"),
        failing("both", "NRM-3"),
    ]
    counts = dict.fromkeys(LEDGER, 0) | {"planned": 9, "fail": 7, "pass": 2}
    gate = GATE | {
        "red": True, "regressions": ["new: float32: fail, and no entry is about it"], "mended": ["z: pass, was fail"],
        "worse": ["both: wrong pixels 12, was 3"], "cases": ["both", *(f"old/{k}" for k in range(5))],
    }  # fmt: skip
    results: Any = {"summary": counts, "checks": counts, "cases": cases, "gate": gate}

    assert headline(results) == (
        "The gate known.json is red: 2 new (normal NRM-3 (world normal by the inverse transpose) in 2 cases), "
        "5 accepted, 1 mended; 9 cases: 7 fail, 2 pass."
    )
    assert [(group.accepted, group.count) for group in failure_groups(results)] == [(False, 2), (True, 5)]
