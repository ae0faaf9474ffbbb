"""No cell of the ledger is empty, every path has a fault, and a survivor or a path that nobody meets is a hole."""

import json

import pytest

from rayproof.cases.families import all_cases, select
from rayproof.reports.paths import ledger
from rayproof.reports.paths.verdict import count_paths, together
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.paths import PATHS
from tests.harness.audit.faults import FAULTS
from tests.harness.audit.planted import in_paths
from tests.harness.paths.__main__ import paths


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


def test_the_kept_audit_speaks_of_every_fault_in_a_path() -> None:
    named = {name for name in FAULTS if FAULTS.about(name).get("path")}

    assert set(ledger.kept()["faults"]) == named
    assert all(one["killed"] for one in ledger.kept()["faults"].values())


def test_a_path_that_no_case_meets_is_a_hole() -> None:
    few = ledger.ledger(select(["primitives/sphere"]), in_paths())

    assert "trees/cubes: executed" in few["empty"]
    assert "trees/cubes: compared" in few["empty"]
    assert not [hole for hole in few["empty"] if hole.startswith("route/stages")]


def test_a_fault_that_survived_is_a_hole_and_one_of_other_code_is_not_measured(monkeypatch: pytest.MonkeyPatch) -> None:
    record = ledger.kept()
    survived = {name: one | {"killed": name != "path/single_leaf"} for name, one in record["faults"].items()}
    monkeypatch.setattr(ledger, "kept", lambda: record | {"current": True, "faults": survived})
    assert "trees/a single leaf: shown to matter" in ledger.ledger(all_cases(), in_paths())["empty"]

    monkeypatch.setattr(ledger, "kept", lambda: record | {"current": False})
    stale = ledger.ledger(all_cases(), in_paths())
    assert stale["empty"] == []
    assert not any(entry["measured"] for entry in stale["paths"])


def test_what_this_machine_cannot_run_is_not_measured(suite: dict, capsys: pytest.CaptureFixture[str]) -> None:
    by_name = {entry["name"]: entry for entry in suite["paths"]}
    elsewhere = [entry for name, entry in by_name.items() if name.startswith("backend/") and not entry["executed"]]

    assert elsewhere
    assert all(not entry["measured"] and entry["why"] for entry in elsewhere)
    assert paths() == 0
    assert "0 empty cells" in capsys.readouterr().out


def test_a_record_without_faults_in_paths_is_refused(tmp_path) -> None:
    (tmp_path / "audit.json").write_text(json.dumps({"faults": []}))

    with pytest.raises(Exception, match="no audit of paths"):
        paths(keep=tmp_path / "audit.json")


def test_what_a_run_found_is_kept_beside_what_the_audit_said(tmp_path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ledger, "RECORD", tmp_path / "record.json")
    ratio = {"configuration": "float32", "ratio": 0.25}
    fault = {"name": "path/single_leaf", "killed": True, "blamed_right": True, "blamed_stage": "ray", "killed_by": []}
    run = {
        "cases": [
            {
                "name": "faces/nine",
                "verdict": "pass",
                "checks": [ratio],
                "consistency": [{"path": "frames", "worst": 0.5}],
            },
            {"name": "faces/one", "verdict": "fail", "checks": [ratio | {"ratio": "inf"}]},
            {
                "name": "primitives/sphere",
                "verdict": "pass",
                "checks": [ratio | {"configuration": "float32/ray=matrix"}],
            },
        ]
    }

    assert ledger.keep({"faults": [fault]}, in_paths()) == "1 faults"
    assert ledger.keep(run, in_paths()) == "2 comparisons"

    assert ledger.kept()["worst"] == {"": {"faces/nine": 0.25}, "frames": {"faces/nine": 0.5}}
    assert set(ledger.kept()["faults"]) == {"path/single_leaf"}
    by_name = {entry["name"]: entry for entry in ledger.ledger(all_cases(), in_paths())["paths"]}
    assert [one["worst"] for one in by_name["route/frames"]["compared"]] == [0.5, None]
    assert by_name["route/numbers"]["compared"][0]["worst"] is None


def test_a_run_counts_what_it_took_and_compared() -> None:
    (case,) = select(["faces/nine"])
    by = [ledger.met_by_case(case.scene, Configuration(precision=name), ("frames",)) for name in ("float32", "float64")]
    record = {"paths": together(by), "checks": [], "consistency": [{"path": "frames"}]}

    counted: dict[str, dict[str, int]] = {}
    count_paths(counted, record)

    assert counted["route/frames"] == {"executed": 1, "compared": 1}
    assert counted["route/stages"] == {"executed": 1, "compared": 0}
