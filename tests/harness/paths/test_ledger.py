"""No cell of the ledger is empty, every path has a fault, and a survivor or a path that nobody meets is a hole."""

# pyright: reportArgumentType=false, reportReturnType=false
# Records are incomplete on purpose.

import json
from pathlib import Path

import pytest

from rayproof.cases.families import all_cases, select
from tests.command_line import Command
from tests.harness.audit.faults import FAULTS
from tests.harness.audit.planted import in_paths
from tests.harness.paths import ledger
from tests.harness.paths.__main__ import paths
from tests.harness.paths.declared import PATHS


@pytest.fixture(scope="module")
def suite() -> dict:
    return ledger.ledger(all_cases(), in_paths())


def test_every_path_is_executed_compared_and_shown_to_matter(suite: dict) -> None:
    assert suite["empty"] == []


def test_every_path_is_declared_once_and_has_a_fault_of_its_own(suite: dict) -> None:
    names = [path.name for path in PATHS]
    planted = {FAULTS.about(name).get("path") for name in FAULTS} - {None}

    assert len(set(names)) == len(names)
    # Every fault is planted on a backend; none of them is one backend's alone.
    assert planted == {name for name in names if not name.startswith("backend/")}


def test_a_path_that_no_case_meets_is_a_hole() -> None:
    few = ledger.ledger(select(["primitives/sphere"]), in_paths())

    assert "trees/cubes: executed" in few["empty"]
    assert "trees/cubes: compared" in few["empty"]
    assert not [hole for hole in few["empty"] if hole.startswith("route/stages")]


def test_a_fault_that_survived_is_a_hole_and_one_that_was_not_audited_is_not_measured(suite: dict) -> None:
    named = [name for name in FAULTS if FAULTS.about(name).get("path")]
    audited = [{"name": name, "killed": name != "path/single_leaf", "blamed_right": True} for name in named]

    audit = ledger.ledger(select(["faces/one"]), in_paths(), audited=audited)

    assert "trees/a single leaf: shown to matter" in audit["empty"]
    assert [hole for hole in audit["empty"] if "trees/two roots: shown" in hole] == []
    assert not any(entry["measured"] for entry in suite["paths"])


def test_what_this_machine_cannot_run_is_not_measured(suite: dict) -> None:
    by_name = {entry["name"]: entry for entry in suite["paths"]}
    elsewhere = [entry for name, entry in by_name.items() if name.startswith("backend/") and not entry["executed"]]

    assert elsewhere
    assert all(not entry["measured"] and entry["why"] for entry in elsewhere)


def test_the_command_shows_the_ledger_and_refuses_what_is_no_audit(command: Command, tmp_path: Path) -> None:
    (tmp_path / "audit.json").write_text(json.dumps({"cases": []}))

    ended, refused = command(paths), command(paths, "--audit", tmp_path / "audit.json")

    assert ended.code == 0
    assert "0 empty cells" in ended.out
    assert (refused.code, "is no audit" in refused.error) == (2, True)


def test_the_worst_of_a_comparison_stands_beside_the_paths_that_it_took() -> None:
    cases = select(["faces/nine"])
    compared = [{"case": "faces/nine", "path": "frames", "worst": 0.5, "verdict": "pass"}]

    found = ledger.ledger(cases, in_paths(), compared=compared)

    by_name = {entry["name"]: entry for entry in found["paths"]}
    assert [one["worst"] for one in by_name["route/frames"]["compared"]] == [0.5]
    assert by_name["route/numbers"]["compared"][0]["worst"] is None
