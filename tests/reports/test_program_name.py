"""Hints name the program as it was called."""

import re
import shlex
import subprocess
import sys
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


def test_an_extra_is_installed_by_the_launcher_of_a_checkout_and_elsewhere_by_pip(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "launcher.py").touch()
    monkeypatch.chdir(tmp_path)
    assert program_name.installing("dask", root=tmp_path) == "./rayproof install dask"
    monkeypatch.chdir("/")
    assert program_name.installing("dask", root=tmp_path) == f"{tmp_path}/rayproof install dask"

    python, *words = shlex.split(program_name.installing("dask", root=tmp_path / "site-packages"))

    assert (python, words[:3]) == (sys.executable, ["-m", "pip", "install"])
    assert [re.split("[<>=]", word)[0] for word in words[3:]] == ["cryptography", "distributed"]
