"""The launcher: a set-up that is remembered, redone when interrupted, and refused in one line."""

import fcntl
import os
import sys
from pathlib import Path

import pytest

import launcher
from tests.conftest import LONGEST

CHECKOUT = Path(__file__).parents[1]


@pytest.fixture
def done(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Do no step of a set-up, but return the titles of those that would have been done."""
    titles: list[str] = []

    def step(title: str, command: list[str]) -> None:
        titles.append(title[:3])
        if "venv" in command:
            folder = Path(command[-1])
            (folder / "bin").mkdir()
            (folder / "bin" / "python").touch()

    monkeypatch.setattr(launcher, "step", step)
    return titles


def test_a_finished_set_up_is_remembered(tmp_path: Path, done: list[str]) -> None:
    launcher.set_up(tmp_path, "requirements.txt")

    assert done == ["1/4", "2/4", "3/4", "4/4"]
    assert launcher.is_ready(tmp_path, "requirements.txt")
    assert not launcher.is_ready(tmp_path, "requirements-dev.txt")


def test_the_development_set_up_serves_both(tmp_path: Path, done: list[str]) -> None:
    launcher.set_up(tmp_path, "requirements.txt")
    launcher.set_up(tmp_path, "requirements-dev.txt")

    assert done[4:] == ["2/4", "3/4", "4/4"]
    assert launcher.is_ready(tmp_path, "requirements.txt")
    assert launcher.is_ready(tmp_path, "requirements-dev.txt")


def test_an_interrupted_set_up_is_redone_from_nothing(
    tmp_path: Path, done: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = launcher.step

    def interrupted(title: str, command: list[str]) -> None:
        whole(title, command)
        if title.startswith("2/4"):
            (tmp_path / "half_copied").touch()
            raise KeyboardInterrupt

    monkeypatch.setattr(launcher, "step", interrupted)
    with pytest.raises(KeyboardInterrupt):
        launcher.set_up(tmp_path, "requirements.txt")
    assert not launcher.is_ready(tmp_path, "requirements.txt")
    monkeypatch.setattr(launcher, "step", whole)

    launcher.set_up(tmp_path, "requirements.txt")

    assert done == ["1/4", "2/4", "1/4", "2/4", "3/4", "4/4"]
    assert not (tmp_path / "half_copied").exists()


def test_a_folder_of_someone_else_is_left_alone(tmp_path: Path, done: list[str]) -> None:
    (tmp_path / "thesis.tex").touch()

    with pytest.raises(launcher.SetupError, match="was not made by"):
        launcher.set_up(tmp_path, "requirements.txt")

    assert (tmp_path / "thesis.tex").exists()
    assert done == []


def test_a_second_set_up_waits_for_the_first(tmp_path: Path) -> None:
    with launcher.lock(tmp_path):
        handle = os.open(tmp_path, os.O_RDONLY)
        with pytest.raises(BlockingIOError):
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)

    fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    os.close(handle)


@pytest.mark.process
def test_a_failed_step_is_told_by_its_error() -> None:
    with pytest.raises(launcher.SetupError, match=r"^sulking failed: ERROR: no$"):
        launcher.step("1/1 sulking", [sys.executable, "-c", "print('hm'); print('ERROR: no'); print('a'); exit(1)"])


@pytest.mark.parametrize(
    ("arguments", "several"),
    [
        ([], True),
        (["-m", "not process"], True),
        (["tests/tracer", "-m", "not process"], True),
        (["tests/test_launcher.py"], False),
        (["tests/tracer", "-k", "sphere"], False),
    ],
)
def test_whole_folders_and_what_markers_choose_are_tested_in_several_processes(
    arguments: list[str], several: bool
) -> None:
    assert bool(launcher.in_processes(arguments)) == several


def test_the_quick_tests_start_nothing_and_run_in_several_processes() -> None:
    words = launcher.words_of_pytest(["--quick", "tests/tracer"])

    assert words == [
        *launcher.SIDE_BY_SIDE,
        "-m",
        "not browser and not process and not references and not slow",
        "tests/tracer",
    ]
    assert launcher.words_of_pytest(["tests/test_launcher.py"]) == ["tests/test_launcher.py"]


def test_tests_keep_compiled_files_in_the_environment_where_none_may_lie_beside_the_sources(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    surroundings = {"PYTHONDONTWRITEBYTECODE": "1", "RAYPROOF_VENV": str(tmp_path)}
    monkeypatch.setattr(os, "environ", surroundings)
    monkeypatch.setattr(launcher, "is_ready", lambda *_: True)
    monkeypatch.setattr(os, "execv", lambda *_: sys.exit(0))
    monkeypatch.chdir(CHECKOUT)

    with pytest.raises(SystemExit):
        launcher.main(["test"])

    assert surroundings == {"PYTHONPYCACHEPREFIX": str(tmp_path / "pycache"), "RAYPROOF_VENV": str(tmp_path)}


def test_what_is_begun_first_is_there() -> None:
    assert [name for name in LONGEST if not (CHECKOUT / "tests" / name).is_file()] == []
