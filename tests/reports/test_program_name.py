"""Hints name the program as it was called."""

import re
import shlex
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
