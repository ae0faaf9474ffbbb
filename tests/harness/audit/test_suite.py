"""The command, end to end on a few faults: exit code and audit.json."""

from pathlib import Path

from tests.command_line import Command
from tests.harness.audit.__main__ import audit


def test_bad_usage_is_told_in_one_line(command: Command, tmp_path: Path) -> None:
    for words in (("--only", "nothing"), ("--jobs", 0)):
        ended = command(audit, *words, "--out", tmp_path)

        assert (ended.code, ended.error.count("\n")) == (2, 1)
