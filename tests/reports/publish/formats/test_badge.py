"""The badge says the verdict in words, and nothing else."""

from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

from rayproof.reports.publish.summaries import YELLOW
from rayproof.reports.publish.summaries import publish_badge as publish
from tests.reports.publish.sample import make_folder, results_of


def said(path: Path) -> str:
    root = ElementTree.fromstring(path.read_text())
    return " ".join(text.text or "" for text in root.iter("{http://www.w3.org/2000/svg}text"))


GATE = {"red": False, "sentence": "The gate known.json is green: what fails is known.", "cases": ["a/b"]}
HALF = {"answered": {"checks": 40, "planned": 100, "cases": 1, "planned_cases": 1, "left_out": []}}
FEW = {"answered": {"checks": 10, "planned": 60, "cases": 1, "planned_cases": 6, "left_out": []}}


@pytest.mark.parametrize(
    ("change", "words", "color"),
    [
        ({"verdict": "fail", "gate": GATE}, "gate green: 1 of 1 pass, 1 known to fail", "#2a7f3f"),
        ({"verdict": "pass", "gate": GATE | {"red": True, "cases": []}}, "gate red: 1 of 1 pass", "#b3261e"),
        ({"verdict": "pass", **HALF}, "1 of 1 pass, 40 % answered", "#2a7f3f"),
        ({"verdict": "pass", **FEW}, "few answers: 1 of 1 pass, 16 % answered", YELLOW),
        ({"verdict": "pass", **FEW, "least_coverage": 10.0}, "1 of 1 pass, 16 % answered", "#2a7f3f"),
        ({"verdict": "pass", "answered": {"checks": 50, "planned": 100}}, "1 of 1 pass, 50 % answered", "#2a7f3f"),
        ({"verdict": "pass", "answered": {"left_out": ["leaves out normal"]}}, "1 of 1 pass", YELLOW),
        ({"verdict": "fail", **FEW}, "fail: 1 of 1 pass, 16 % answered", "#b3261e"),
    ],
    ids=["green", "red", "part of each", "few", "few are enough", "half", "left out", "few and wrong"],
)
def test_the_gate_comes_first_and_a_pass_that_says_little_is_yellow(
    change: dict[str, Any], words: str, color: str, tmp_path: Path
) -> None:
    cases = [case for case in make_folder(tmp_path)["cases"] if case["verdict"] == "pass"]

    (path,) = publish(tmp_path, results_of(cases) | change)

    assert said(path) == f"rayproof {words}"
    assert f'fill="{color}"/>' in path.read_text()
