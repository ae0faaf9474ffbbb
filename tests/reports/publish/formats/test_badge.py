"""The badge says the verdict in words, and nothing else."""

from pathlib import Path
from xml.etree import ElementTree

import pytest

from rayproof.reports.publish.summaries import publish_badge as publish
from tests.reports.publish.sample import make_folder, results_of


def said(path: Path) -> str:
    root = ElementTree.fromstring(path.read_text())
    return " ".join(text.text or "" for text in root.iter("{http://www.w3.org/2000/svg}text"))


def test_a_failing_run_says_so(tmp_path: Path) -> None:
    results = make_folder(tmp_path) | {"verdict": "fail"}

    (path,) = publish(tmp_path, results)

    assert said(path) == "rayproof fail: 2 of 9 pass"


def test_a_passing_run_counts(tmp_path: Path) -> None:
    cases = [case for case in make_folder(tmp_path)["cases"] if case["verdict"] == "pass"]

    (path,) = publish(tmp_path, results_of(cases) | {"verdict": "pass"})

    assert said(path) == "rayproof 1 of 1 pass"


@pytest.mark.parametrize("change", [{"faults": ["sphere/inside_out"]}, {"finished": False}])
def test_what_is_shouted_is_no_verdict(change: dict, tmp_path: Path) -> None:
    cases = [case for case in make_folder(tmp_path)["cases"] if case["verdict"] == "pass"]

    (path,) = publish(tmp_path, results_of(cases) | {"verdict": "pass"} | change)

    assert said(path) == "rayproof not a verdict"
