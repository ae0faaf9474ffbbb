"""Hints name the program as it was called."""

import subprocess
from pathlib import Path

import pytest

from rayproof.reports import program_name
from tests.reports.commands.conftest import Rayproof, rayproof

__all__ = ["rayproof"]


def test_a_hint_names_the_launcher_of_a_checkout(
    rayproof: Rayproof, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(program_name.VARIABLE, "./rayproof")

    ended = rayproof("new", "adapter", tmp_path / "mine.py")

    assert "    ./rayproof run primitives/sphere" in ended.out


@pytest.mark.process
def test_the_launcher_says_how_it_was_called(tmp_path: Path) -> None:
    (tmp_path / "rayproof").write_text((Path(__file__).parents[2] / "rayproof").read_text())
    (tmp_path / "launcher.py").write_text("import os\nprint(os.environ['RAYPROOF_CALLED'])\n")

    said = subprocess.run(["sh", "./rayproof"], cwd=tmp_path, capture_output=True, text=True, check=True).stdout

    assert said == "./rayproof\n"


def test_a_program_on_nobody_s_path_is_named_by_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.argv", [".venv/bin/rayproof", "run"])
    for found, name in ((None, ".venv/bin/rayproof"), ("/usr/bin/rayproof", "rayproof")):
        monkeypatch.delenv(program_name.VARIABLE, raising=False)
        monkeypatch.setattr("shutil.which", lambda _, found=found: found)

        program_name.remember()

        assert program_name.called() == name
    monkeypatch.delenv(program_name.VARIABLE, raising=False)
