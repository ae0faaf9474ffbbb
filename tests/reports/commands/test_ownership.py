"""A folder has one writer: the second is refused in a line that names the first, however the first was started."""

import errno
import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from rayproof.reports.ownership import NAME, OwnedError, abandoned, owned
from tests.reports.commands.conftest import Rayproof

CHECKOUT = Path(__file__).parents[3]
OWNING = """
import sys, time
from pathlib import Path
from rayproof.reports.ownership import owned
with owned(Path(sys.argv[1])):
    print("owned", flush=True)
    time.sleep(60)
"""


@pytest.fixture
def owner(tmp_path):
    """Return a process that owns a folder."""
    process = subprocess.Popen(
        [sys.executable, "-c", OWNING, str(tmp_path / "out")], cwd=CHECKOUT, stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "owned\n"
    yield process
    process.kill()
    process.communicate()


@pytest.mark.process
def test_the_second_is_refused_in_one_line_that_names_the_first(owner, rayproof: Rayproof, tmp_path: Path):
    ended = rayproof("run", "primitives/sphere", "--out", tmp_path / "out")

    assert ended.code == 2
    assert ended.error.count("\n") == 1
    assert f"process {owner.pid} (rayproof" in ended.error
    assert " since 20" in ended.error
    assert str(tmp_path / "out") in ended.error
    assert ended.out == ""


@pytest.mark.process
def test_a_folder_whose_owner_was_killed_is_free(owner, tmp_path: Path):
    owner.send_signal(signal.SIGKILL)
    owner.wait()

    assert abandoned(tmp_path / "out")
    with owned(tmp_path / "out"):
        assert not abandoned(tmp_path / "out")
    assert list((tmp_path / "out").iterdir()) == []


@pytest.mark.process
def test_a_stopped_owner_still_owns(owner, tmp_path: Path):
    owner.send_signal(signal.SIGSTOP)

    with pytest.raises(OwnedError, match="is writing it"), owned(tmp_path / "out"):
        pass


@pytest.mark.process
@pytest.mark.parametrize("said", ["", "[", "[]", '{"pid": "x"}', '{"pid": 1, "command": "\\u001b[2J", "since": "\\n"}'])
def test_whatever_the_file_says_a_refusal_is_one_plain_line(said, owner, tmp_path: Path):
    (tmp_path / "out" / NAME).write_text(said)

    with pytest.raises(OwnedError) as refused, owned(tmp_path / "out"):
        pass

    assert (refused.value.strerror or "").isprintable()


def test_who_owns_it_is_said_in_the_file(tmp_path: Path):
    with owned(tmp_path):
        assert json.loads((tmp_path / NAME).read_text())["pid"] == os.getpid()


@pytest.mark.process
def test_what_starts_meanwhile_does_not_own(tmp_path: Path):
    with owned(tmp_path):
        child = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(60)"], close_fds=False)
    try:
        with owned(tmp_path):
            pass
    finally:
        child.kill()
        child.wait()


def test_where_there_are_no_locks_nobody_is_refused_and_nothing_is_taken_for_abandoned(tmp_path: Path, monkeypatch):
    def none(*_: object) -> None:
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr("fcntl.flock", none)
    with owned(tmp_path), owned(tmp_path):
        assert not abandoned(tmp_path)
