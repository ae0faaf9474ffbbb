"""`rayproof list` names everything that is registered, to readers and to programs."""

import json
from pathlib import Path

import pytest

from rayproof.cases.families import CASE_FAMILIES, all_cases, cases_of
from rayproof.reference import REFERENCES
from rayproof.reports.diagnosis.pages import listed
from rayproof.reports.judge.metrics import METRICS
from rayproof.tracer.formulas import FORMULAS
from tests.reports.commands.conftest import Rayproof

KINDS = {
    "cases": lambda: [case.name for family in CASE_FAMILIES for case in cases_of(family)],
    "formulas": lambda: sorted(FORMULAS),
    "references": lambda: list(REFERENCES),
    "metrics": lambda: list(METRICS),
    "mistakes": lambda: list(listed()),
}


@pytest.mark.process
@pytest.mark.parametrize("kind", KINDS)
def test_list_names_everything_registered(rayproof: Rayproof, tmp_path: Path, kind: str) -> None:
    ended = rayproof("list", kind, "--json", tmp_path / "list.json")

    assert ended.code == 0
    listed = json.loads((tmp_path / "list.json").read_text())[kind]
    assert [one["name"] for one in listed] == KINDS[kind]()
    assert all(one["name"] in ended.out for one in listed)


def test_a_wrong_formula_is_listed_as_such(rayproof: Rayproof, tmp_path: Path) -> None:
    rayproof("list", "formulas", "--json", tmp_path / "list.json")

    kinds = {one["name"]: one["kind"] for one in json.loads((tmp_path / "list.json").read_text())["formulas"]}
    assert {name for name, kind in kinds.items() if kind == "control"}
    assert kinds == {name: FORMULAS[name].kind for name in FORMULAS}


def test_what_is_asked_about_on_request_says_so(rayproof: Rayproof, tmp_path: Path) -> None:
    rayproof("list", "cases", "--json", tmp_path / "list.json")

    listed = json.loads((tmp_path / "list.json").read_text())["cases"]
    assert [one["name"] for one in listed if not one["on_request"]] == [case.name for case in all_cases()]
    assert any(one["on_request"] for one in listed)
