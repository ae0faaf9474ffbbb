"""The command, end to end on a few faults: exit code and audit.json."""

import json
from pathlib import Path

import pytest

from tests.command_line import Command
from tests.harness.audit.__main__ import audit


@pytest.mark.process
def test_an_audit_of_a_few_faults_ends_well_and_says_so(command: Command, tmp_path: Path) -> None:
    copy = tmp_path / "copy.json"

    ended = command(audit, "--only", "lo*der/*s*ed", "--quick", "--out", tmp_path, "--json", copy)

    result = json.loads((tmp_path / "audit.json").read_text())
    assert ended.code == 0
    assert json.loads(copy.read_text()) == result
    assert result["killed"] == result["blamed_right"] == result["planted"] > 2
    assert {fault["where"] for fault in result["faults"]} == {"loader"}
    assert {"name", "where", "stage", "killed", "blamed_stage", "killed_by", "equivalent"} <= set(result["faults"][0])
    assert "PLANTED FAULTS" in ended.out.splitlines()[0]


def test_bad_usage_is_told_in_one_line(command: Command, tmp_path: Path) -> None:
    for words in (("--only", "nothing"), ("--jobs", 0)):
        ended = command(audit, *words, "--out", tmp_path)

        assert (ended.code, ended.error.count("\n")) == (2, 1)
