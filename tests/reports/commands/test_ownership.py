"""A folder has one writer: the second is refused in a line that names the first, however the first was started."""

import signal
import subprocess
import sys
from pathlib import Path

import pytest

from rayproof.reports.ownership import OwnedError, abandoned, owned
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
