"""What stands first in every publication, from records as docs/results.md has them."""

import math
from typing import Any

import pytest

from rayproof.reports.results.headline import worst_ratio

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
