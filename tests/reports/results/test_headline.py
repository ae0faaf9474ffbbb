"""What stands first in every publication, from records as docs/results.md has them."""

import math
from typing import Any

import pytest

from rayproof.reports.results.case_records import worst_ratio
from rayproof.reports.results.headline import headline, last_line
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


def failing(name: str, item: str | None, stage: str = "normal", verdict: str = "fail") -> dict[str, Any]:
    """Return the record of a case that fails at a stage, of which an item is blamed."""
    wrong = {"verdict": verdict, "stage": stage, "reference": "radiance", "configuration": "float32", "ratio": "inf"}
    measured = {"worst_ratio": "inf", "mean_wrong": 0.25}
    check = recorded(**wrong, examined={"pixels": 4800, "wrong": 12}, end_to_end=measured)
    return {"name": name, "verdict": verdict, "stage": stage, "item": item, "checks": [check]}
