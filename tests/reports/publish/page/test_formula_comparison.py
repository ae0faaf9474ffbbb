"""What `rayproof compare` left in a folder reaches the report; what is no comparison of formulas does not."""

import copy
import json
from pathlib import Path
from typing import Any

from rayproof.reports.publish.page.comparisons import NAME, contest

FAMILY = {
    "family": "sphere", "stress": False, "outcome": "better", "scenes": 2, "pixels": 900, "digits_gained": 0.94,
    "digits_interval": [0.37, 1.8], "wrong": {"base": 7, "candidate": 0, "p": 0.016}, "errors": {"object": {}},
    "time_ratio": 1.17, "time_interval": [1.15, 1.22], "nanoseconds_per_ray": [2.5, 3.0],
}  # fmt: skip
FOUND: dict[str, Any] = {
    "base": "sphere/textbook", "candidate": "sphere/<b>haines", "verdict": "A trade: it errs less.",
    "outcome": "mixed", "repetitions": 31, "stages": ["object"], "faults": [],
    "control": {"verdict": "No difference shown.", "families": []},
    "families": [
        FAMILY,
        FAMILY | {"family": "far", "stress": True, "digits_gained": None, "digits_interval": None, "time_ratio": "inf"},
    ],
}  # fmt: skip


def test_only_a_comparison_of_formulas_is_shown(tmp_path: Path) -> None:
    def of(content: Any) -> Any:
        (tmp_path / NAME).write_text(json.dumps(content))
        return contest(tmp_path)

    assert contest(tmp_path) is None
    for content in ([], {}, FOUND | {"control": None}, FOUND | {"families": [{"digits_interval": 3}]}):
        assert of(content) is None
    found = of(copy.deepcopy(FOUND))
    assert found["families"][0]["wrong"] == [7, 0, 0.016]
    assert "errors" not in found["families"][0]
