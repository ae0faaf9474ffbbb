"""What stands first in every publication, from records as docs/results.md has them."""

import math
from typing import Any

import pytest

from rayproof.reports.results.case_records import worst_ratio
from rayproof.reports.results.headline import headline, last_line, worse_by_cause
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


GATE = {"sentence": "The gate known.json is green: what fails is known.", "red": False, "cases": ["a/b"]}


def test_the_gate_comes_before_the_cases() -> None:
    green = run_of("fail", gate=GATE)
    red = run_of("pass", gate=GATE | {"red": True, "sentence": "The gate known.json is red: 1 better.", "cases": []})

    assert headline(green) == f"{GATE['sentence']} Let through: 1 case: 1 fail."
    assert last_line(green) == "gate green; cases: fail"
    assert headline(red).startswith("The gate known.json is red: 1 better. 1 case: all pass")
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
