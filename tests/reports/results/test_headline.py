"""What stands first in every publication, from records as docs/results.md has them."""

import math
from typing import Any

import pytest

from rayproof.reports.results.case_records import worst_ratio
from rayproof.reports.results.headline import worse_by_cause

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
    assert worst_ratio({"checks": [check]}) == ratio


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
