"""What a stranger's program finds in its enclosure, and what it and all that it starts cannot do."""

import socket
import time
from dataclasses import replace
from pathlib import Path

import pytest

from rayproof.reports.subjects import Enclosure, Surroundings, calls, reason_unconfined
from rayproof.reports.subjects.calls import Ended, call

pytestmark = pytest.mark.process
SYSTEM = ("/usr", "/bin", "/sbin", "/lib", "/lib64", "/etc/alternatives", "/etc/ld.so.cache")
MIB = 2**20


@pytest.fixture
def enclosure(tmp_path: Path) -> Enclosure:
    (tmp_path / "submission").mkdir()
    (tmp_path / "submission" / "mine.txt").write_text("mine")
    (tmp_path / "neighbour").mkdir()
    (tmp_path / "neighbour" / "theirs.txt").write_text("secret of the neighbour")
    found = Enclosure(
        submission=str(tmp_path / "submission"),
        allowed=tuple(path for path in SYSTEM if Path(path).exists()),
        masked=(),
        environment=(("PATH", "/usr/bin:/bin"), ("HOME", "/tmp")),
        processes=16,
        memory=128 * MIB,
        disk=16 * MIB,
        seconds=2.0,
        turns=str(tmp_path / "turns"),
    )
    if (why := reason_unconfined(Surroundings(enclosure=found))) is not None:
        pytest.skip(why)
    return found


def shell(enclosure: Enclosure, script: str) -> tuple[Ended, Path]:
    """Run a shell's script in an enclosure; return how it ended, and the folder of the call."""
    folder = Path(enclosure.turns).parent / "call"
    folder.mkdir(exist_ok=True)
    (folder / "scene.json").write_text("{}")
    (folder / "image.exr").unlink(missing_ok=True)
    surroundings = Surroundings(enclosure=enclosure)
    words = ["/bin/sh", "-c", script]
    return call(words, folder, seconds=60, memory=1024 * MIB, output=32 * MIB, surroundings=surroundings), folder


def test_it_reads_its_own_folder_and_scene_and_brings_out_its_image_alone(enclosure: Enclosure) -> None:
    ended, folder = shell(
        enclosure, "cat mine.txt /tmp/call/scene.json; echo drawn > /tmp/call/image.exr; touch /tmp/call/x"
    )
    assert (ended.problem, ended.said) == (None, "mine{}")
    assert (folder / "image.exr").read_text() == "drawn\n"
    assert sorted(path.name for path in folder.iterdir()) == ["image.exr", "scene.json"]


def test_nothing_is_there_but_what_is_allowed(enclosure: Enclosure, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SECRET", "of the teacher")
    there = Path(enclosure.turns).parent / "neighbour" / "theirs.txt"
    script = f"cat {there}; ls -A / /tmp; env; ls /proc | grep -c '^[0-9]'; ls /proc/self/fd; cat /proc/1/cmdline"
    ended, _ = shell(enclosure, script)
    assert "secret" not in ended.said
    assert "SECRET" not in ended.said
    assert str(there.parent.parent) not in ended.said
    names = {"bin", "dev", "etc", "lib", "lib64", "proc", "sbin", "submission", "tmp", "usr"}
    assert {*ended.said.split("/:\n")[1].split("\n\n")[0].split()} <= names


def test_what_it_writes_is_lost_or_refused(enclosure: Enclosure) -> None:
    ended, _ = shell(
        enclosure, "echo x > /submission/y; echo x > /usr/y; echo x > /y; echo x > /tmp/y; ls /tmp /submission"
    )
    assert ended.complaint.count("Read-only file system") == 3
    assert not (Path(enclosure.submission) / "y").exists()
    again, _ = shell(enclosure, "ls /tmp")
    assert again.said == "call\n"


def test_it_reaches_no_network(enclosure: Enclosure) -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
        script = f"python3 -c 'import socket; socket.create_connection((\"127.0.0.1\", {port}), 1)'"
        ended, _ = shell(enclosure, f"command -v python3 >/dev/null || exit 9; {script}")
    assert ended.problem is not None


def test_a_fork_bomb_ends_at_its_limit_and_with_its_call(enclosure: Enclosure) -> None:
    ended, _ = shell(enclosure, "bomb() { bomb | bomb & }; bomb; sleep 0.3; ls /proc | grep -c '^[0-9]'")
    assert ended.problem is not None or int(ended.said) <= enclosure.processes
    assert not [path for path in Path("/proc").glob("[0-9]*") if b"bomb" in _command(path)]


def _command(process: Path) -> bytes:
    try:
        return (process / "cmdline").read_bytes()
    except OSError:
        return b""


@pytest.mark.parametrize(
    ("script", "said"),
    [
        ("head -c 300m /dev/zero | tail", "MiB of memory"),
        ("while :; do :; done", "of processor time"),
        ("(while :; do :; done) & (while :; do :; done) & wait", "of processor time"),
        ("ln -s /etc/ld.so.cache /tmp/call/image.exr", "no regular file"),
        ("mkfifo /tmp/call/image.exr", "no regular file"),
        ("yes", "too large"),
        ("cat /dev/zero > /tmp/large", "No space left"),
        ("kill -9 1", "exit code"),
    ],
)
def test_what_is_too_much_or_no_image_ends_in_an_error(enclosure: Enclosure, script: str, said: str) -> None:
    ended, _ = shell(replace(enclosure, seconds=0.5), script)
    assert ended.problem is not None
    assert said in ended.problem


def test_a_call_near_its_limit_is_made_again_while_no_other_runs(
    enclosure: Enclosure, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = []

    def slow(*_: object) -> Ended:
        made.append(enclosure.turns)
        time.sleep(0.09)
        return Ended(problem=None, refusal=None, said="")

    monkeypatch.setattr(calls, "_called", slow)
    shell(replace(enclosure, seconds=0.01), "")
    assert len(made) == 2
    shell(replace(enclosure, seconds=1.0), "")
    assert len(made) == 3


def test_a_build_writes_products_whose_links_stay_below_them(enclosure: Enclosure, tmp_path: Path) -> None:
    (tmp_path / "products").mkdir()
    building = replace(enclosure, products=str(tmp_path / "products"))
    ended, _ = shell(building, "echo built > made; ln -s made name; chmod +x made")
    assert ended.problem is None
    assert (tmp_path / "products" / "name").resolve() == tmp_path / "products" / "made"
    assert not (Path(enclosure.submission) / "made").exists()
    (tmp_path / "others").mkdir()
    ended, _ = shell(replace(building, products=str(tmp_path / "others")), "ln -s ../neighbour out")
    assert "leads out of its folder" in (ended.problem or "")


def test_without_namespaces_it_says_so(enclosure: Enclosure) -> None:
    why = reason_unconfined(Surroundings(enclosure=replace(enclosure, allowed=("/nowhere",))))
    assert why is not None
    assert "cannot be confined" in why
