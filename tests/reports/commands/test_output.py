"""Tables are text, JSON is strict, and a planted fault is shouted first."""

import json
from pathlib import Path

import pytest

from rayproof.reports.commands.output import shout, show_table, write_json


def test_a_planted_fault_is_shouted(capsys: pytest.CaptureFixture[str]) -> None:
    shout(["sphere/far_root"])

    assert capsys.readouterr().out.startswith("PLANTED FAULT IN USE: sphere/far_root")


def test_without_faults_nothing_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    shout([])

    assert capsys.readouterr().out == ""


def test_a_cell_is_text_and_not_markup(capsys: pytest.CaptureFixture[str]) -> None:
    show_table("title", ["column"], [["[red]E[/red]"]])

    assert "[red]E[/red]" in capsys.readouterr().out


def test_numbers_that_json_lacks_become_strings(tmp_path: Path) -> None:
    write_json(tmp_path / "a.json", {"values": (float("nan"), float("-inf"), 0.1)})

    assert json.loads((tmp_path / "a.json").read_text()) == {"values": ["nan", "-inf", 0.1]}
