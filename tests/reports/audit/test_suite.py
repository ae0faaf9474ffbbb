"""The command, end to end on a few faults: exit code, audit.json and the report that shows it."""

import json
from pathlib import Path

import pytest

from rayproof.reports.cli import main


@pytest.mark.process
def test_an_audit_of_a_few_faults_ends_well_and_says_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    copy = tmp_path / "copy.json"

    code = main(["audit", "--only", "lo*der/*s*ed", "--quick", "--out", str(tmp_path), "--json", str(copy)])

    result = json.loads((tmp_path / "audit.json").read_text())
    assert code == 0
    assert json.loads(copy.read_text()) == result
    assert result["killed"] == result["blamed_right"] == result["planted"] > 2
    assert {fault["where"] for fault in result["faults"]} == {"loader"}
    assert {"name", "where", "stage", "killed", "blamed_stage", "killed_by", "equivalent"} <= set(result["faults"][0])
    assert "PLANTED FAULTS" in capsys.readouterr().out.splitlines()[0]


def test_bad_usage_is_told_in_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["audit", "--only", "nothing", "--out", str(tmp_path)]) == 2
    assert main(["audit", "--jobs", "0", "--out", str(tmp_path)]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 2
