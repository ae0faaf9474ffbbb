"""What a program under test gets of its user's surroundings, and what it cannot reach where it is confined."""

import json
import os
import socket
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from rayproof.cases.stages import Stage
from rayproof.reports.subjects import Surroundings, reason_unconfined
from rayproof.reports.subjects.calls import Ended, call
from rayproof.reports.subjects.choosing import chosen
from rayproof.reports.subjects.program import ask_program
from tests.reports.subjects.conftest import SCENE, Writing

REPORT = "import json, os; print(json.dumps(dict(os.environ)))"
# Tries everything that docs/protocol.md says, and tells in JSON what it got.
HOSTILE = """
import json, os, socket, subprocess, sys
def tried(act):
    try:
        return str(act())[:10000]
    except Exception as error:
        return f"no: {type(error).__name__}"
entry, parent, server, beside = sys.argv[1:]
print(json.dumps({
    "entry": tried(lambda: open(entry).read()),
    "parent's environment": tried(lambda: open(f"/proc/{parent}/environ").read()),
    "own parent's environment": tried(lambda: open(f"/proc/{os.getppid()}/environ").read()),
    "network": tried(lambda: socket.create_connection(("127.0.0.1", int(server)), 2)),
    "beside": tried(lambda: open(beside, "w").write("here")),
    "home": tried(lambda: os.listdir(os.path.expanduser("~"))),
    "unhide": tried(lambda: subprocess.run(["umount", os.path.dirname(entry)], capture_output=True, check=True)),
    "folder": tried(lambda: open("image", "w").write("here")),
}))
"""
confinable = pytest.mark.skipif((reason_unconfined() or "") != "", reason=str(reason_unconfined()))


def called(folder: Path, code: str, *arguments: str, surroundings: Surroundings | None = None) -> Ended:
    command = [sys.executable, "-I", "-S", "-c", code, *arguments]
    return call(command, folder, seconds=60, memory=2**33, output=2**20, surroundings=surroundings or Surroundings())


@pytest.mark.process
def test_a_program_gets_what_it_needs_and_no_token(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("GITHUB_TOKEN", "RAYPROOF_CACHE_KEY", "LC_TIME", "MY_LICENSE", "OMP_NUM_THREADS", "CUDA_HOME"):
        monkeypatch.setenv(name, "value")

    got = json.loads(called(tmp_path, REPORT).said)
    more = json.loads(called(tmp_path, REPORT, surroundings=Surroundings(variables=("MY_LICENSE",))).said)

    assert {"PATH", "LC_TIME", "OMP_NUM_THREADS", "CUDA_HOME"} <= set(got)
    assert not {"GITHUB_TOKEN", "RAYPROOF_CACHE_KEY", "MY_LICENSE"} & set(got)
    assert set(more) - set(got) == {"MY_LICENSE"}


@pytest.mark.process
def test_a_program_that_fails_is_told_what_was_withheld(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MY_LICENSE", "value")

    ended = called(tmp_path, "import os; os.environ['MY_LICENSE']")

    count = Surroundings().withheld
    assert count >= 1
    assert f"exit code 1: KeyError: 'MY_LICENSE' ({count} environment variable" in (ended.problem or "")
    assert "withheld; --env NAME passes one on)" in (ended.problem or "")


def test_a_variable_that_is_not_there_is_no_name() -> None:
    with pytest.raises(ValueError, match="--env NOT_SET: there is no environment variable"):
        chosen(
            f"exec:{sys.executable} {{output}}",
            seconds=1,
            memory=2**30,
            ask=lambda _: pytest.fail("asked"),
            surroundings=Surroundings(variables=("NOT_SET",)),
        )
    with pytest.raises(ValueError, match="are for a program under test"):
        chosen(
            "mitsuba_scalar",
            seconds=1,
            memory=2**30,
            ask=lambda _: pytest.fail("asked"),
            surroundings=Surroundings(confined=True),
        )


@pytest.fixture
def attack(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[list[str]]:
    """Return what the hostile program is told: an entry of the cache, its caller, and where somebody listens."""
    monkeypatch.setenv("RAYPROOF_CACHE", str(tmp_path / "cache"))
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    (tmp_path / "home").mkdir()
    (tmp_path / "home" / ".netrc").write_text("secret password")
    monkeypatch.setenv("A_TOKEN", "secret token")
    entry = tmp_path / "cache" / "answer.entry"
    entry.parent.mkdir()
    entry.write_text("secret answer")
    with socket.create_server(("127.0.0.1", 0)) as server:
        yield [str(entry), str(os.getpid()), str(server.getsockname()[1]), str(tmp_path / "beside")]


@pytest.mark.process
def test_without_being_confined_it_reaches_what_its_user_does(tmp_path: Path, attack: list[str]) -> None:
    (tmp_path / "folder").mkdir()

    got = json.loads(called(tmp_path / "folder", HOSTILE, *attack).said)

    assert got["entry"] == "secret answer"
    assert got["network"].startswith("<socket")


@pytest.mark.process
@confinable
def test_confined_it_reaches_neither_cache_nor_environment_nor_network(tmp_path: Path, attack: list[str]) -> None:
    (tmp_path / "folder").mkdir()

    got = json.loads(called(tmp_path / "folder", HOSTILE, *attack, surroundings=Surroundings(confined=True)).said)

    assert got.pop("folder") == "4"
    assert (tmp_path / "folder" / "image").read_text() == "here"
    assert ".netrc" not in got.pop("home")
    assert "secret" not in "".join(got.values())
    # What is written beside is lost where the place is hidden, and refused elsewhere.
    got.pop("beside")
    assert not (tmp_path / "beside").exists()
    assert {name for name, value in got.items() if not value.startswith("no: ")} <= {"own parent's environment"}


@pytest.mark.process
@confinable
def test_confined_a_program_ends_as_it_would(tmp_path: Path) -> None:
    confined = Surroundings(confined=True)

    refused = called(tmp_path, "import sys; print('not this one'); sys.exit(77)", surroundings=confined)
    crashed = called(tmp_path, "import os; os.abort()", surroundings=confined)
    left = called(tmp_path, "import os, time; os.fork() or time.sleep(60)", surroundings=confined)

    assert refused.refusal == "not this one"
    assert "SIGABRT" in (crashed.problem or "")
    assert "confined" in (crashed.problem or "")
    assert left.problem is None  # ended with its namespace


@pytest.mark.process
@confinable
def test_confined_a_program_draws_what_it_would(program: Writing) -> None:
    subject = program(
        "import json, struct",
        "camera = json.load(open(SCENE))['camera']",
        "size = camera['width'], camera['height']",
        "open(OUTPUT, 'wb').write(b'PF\\n%d %d\\n-1.0\\n' % size + bytes(12 * size[0] * size[1]))",
    )

    loose, confined = (
        ask_program(replace(subject, surroundings=Surroundings(confined=shut)), SCENE, samples=1)
        for shut in (False, True)
    )

    assert (loose.error, confined.error) == (None, None)
    assert loose.answers
    assert confined.answers
    assert set(confined.answers) == set(loose.answers) == {Stage.RADIANCE}
