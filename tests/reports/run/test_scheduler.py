"""A run on a cluster finds what a pool finds; plain text and bad input are refused; a case that kills is an error.

The clusters are real: workers of this machine, and `dask scheduler` and `dask worker` as processes on loopback.
"""

import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from rayproof.reports.processes.signals import end_below
from tests.reports.commands.conftest import Rayproof
from tests.reports.commands.test_own_formula import MINE
from tests.reports.run.certificates import Authority

CHECKOUT = Path(__file__).parents[3]
# What differs between two runs that find the same: times, who did it, and pictures, which are drawn afterwards.
OF_A_RUN = {"seconds", "kernels", "launches", "judge_seconds", "worker", "picture", "thumbnail", "reproduce"}
SCENE = {
    "camera": {"eye": [0, -3, 1], "target": [0, 0, 0], "up": [0, 0, 1], "fovy": 40, "width": 16, "height": 12,
               "near": 0.1, "far": 9},
    "shapes": [{"type": "sphere", "albedo": [0.5, 0.5, 0.5]}],
    "lights": [{"position": [2, -3, 4], "flux": [300, 200, 400]}],
}  # fmt: skip
RUN = "import sys; from rayproof.reports.cli import main; code = main(sys.argv[1:]); sys.exit(code)"
# How many modules were imported of the engine's, and of an extra's that a run does not ask for.
COUNTED = (
    "import sys; from rayproof.reports.cli import main; code = main(sys.argv[1:]); "
    "print('imported', sum(name.partition('.')[0] in ('dask', 'distributed', 'tornado', 'msgpack', 'cloudpickle', "
    "'cryptography') for name in sys.modules), file=sys.stderr); sys.exit(code)"
)


def ran(*arguments: object, code: str = RUN, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", code, "run", *map(str, arguments)],
        cwd=CHECKOUT,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        timeout=280,
        check=False,
    )


def found(folder: Path) -> list[dict[str, Any]]:
    return json.loads((folder / "results.json").read_text())["cases"]


def alike(value: Any) -> Any:
    """Return what is the same of two runs that find the same."""
    if isinstance(value, dict):
        return {key: alike(one) for key, one in value.items() if key not in OF_A_RUN}
    return [alike(one) for one in value] if isinstance(value, list) else value


def files(folder: Path) -> dict[str, bytes]:
    paths = (path for place in ("scenes", "images") for path in (folder / place).rglob("*") if path.is_file())
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in paths}


@pytest.mark.process
def test_a_cluster_finds_what_a_pool_finds_to_the_last_byte(tmp_path: Path) -> None:
    (tmp_path / "room.json").write_text(json.dumps(SCENE))
    # A case that fails keeps more images; a scene file's record must not name a folder of a worker's.
    asked = (tmp_path / "room.json", "primitives/sphere", "primitives/cube", "transforms/square_sheared")
    (tmp_path / "mine.py").write_text(MINE)
    (tmp_path / "factor.py").write_text("FACTOR = 0.5\n")
    asked += ("--formula", f"sphere={tmp_path / 'mine.py'}:nearest_hit", "--diagnose", "off", "--no-cache")
    pool = ran(*asked, "--out", tmp_path / "pool", "--jobs", 2, code=COUNTED)
    cluster = ran(*asked, "--out", tmp_path / "cluster", "--scheduler", "local:2")

    assert (pool.returncode, cluster.returncode) == (1, 1), cluster.stderr
    assert pool.stderr.endswith("imported 0\n")
    ours, theirs = found(tmp_path / "pool"), found(tmp_path / "cluster")
    assert [one["name"] for one in ours] == [one["name"] for one in theirs]
    assert alike(ours) == alike(theirs)
    assert files(tmp_path / "pool") == files(tmp_path / "cluster")
    assert any(name.endswith(".exr") for name in files(tmp_path / "cluster"))
    assert str(tmp_path / "cluster" / "scenes") in next(one for one in theirs if one["family"] == "file")["reproduce"]
    engine = json.loads((tmp_path / "cluster" / "results.json").read_text())["engine"]
    assert {one["worker"].partition(":")[0] for one in theirs} == {"tls"}
    assert engine["refused"] == []


class Site:
    """A scheduler and workers as processes, with certificates of one authority."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        folder.mkdir()
        self.authority = Authority(folder)
        self.tls = ("--tls", self.authority.folder("client"))
        self._processes: list[subprocess.Popen[bytes]] = []
        self.scheduler = self._started(
            "scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", folder / "where"
        )
        self.address = self._address()

    def worker(self, **environment: str) -> subprocess.Popen[bytes]:
        about = ("--nthreads", "1", "--no-dashboard", "--memory-limit", "0", "--local-directory", self.folder)
        return self._started("worker", self.address, *about, **environment)

    def _pair(self, name: str, *options: str) -> tuple[object, ...]:
        return tuple(word for pair in zip(options, self.authority.vouched(name), strict=True) for word in pair)

    def _started(self, role: str, *arguments: object, **environment: str) -> subprocess.Popen[bytes]:
        tls = ("--tls-ca-file", self.authority.file, *self._pair(role, "--tls-cert", "--tls-key"))
        process = subprocess.Popen(
            [sys.executable, "-m", "dask", role, *map(str, arguments), *map(str, tls)],
            cwd=CHECKOUT,
            env={**os.environ, "TMPDIR": str(self.folder), "PYTHONPATH": str(CHECKOUT / "python"), **environment},
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        self._processes.append(process)
        return process

    def _address(self) -> str:
        until = time.monotonic() + 60
        while time.monotonic() < until:
            try:
                return json.loads((self.folder / "where").read_text())["address"]
            except (OSError, ValueError):
                time.sleep(0.1)
        raise TimeoutError("no scheduler started")

    def close(self) -> None:
        for process in self._processes:
            end_below(process.pid)
            process.kill()
            process.wait()


@contextmanager
def site(folder: Path) -> Iterator[Site]:
    one = Site(folder)
    try:
        yield one
    finally:
        one.close()


@pytest.fixture(scope="module")
def lonely(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    """Return a scheduler to which no worker comes."""
    with site(tmp_path_factory.mktemp("site") / "lonely") as one:
        yield one


TLS = ("--scheduler", "tls://127.0.0.1:1", "--tls")
# Options, and what the line says about them. ADDRESS is a scheduler's that has no worker, FOLDER holds certificates.
BAD = {
    "another authority": (("--scheduler", "ADDRESS", "--tls", "FOLDER"), "all ends need valid certificates"),
    "expired": (("--scheduler", "ADDRESS", "--tls", "FOLDER"), "all ends need valid certificates"),
    "no worker": (("--scheduler", "ADDRESS", "--tls", "FOLDER"), "0/1 workers arrived after 2"),
    # Refused, or timed out where much else runs.
    "nobody there": ((*TLS, "FOLDER"), "--scheduler tls://127.0.0.1:1: "),
    "absent file": ((*TLS, "FOLDER"), "there is no file cert.pem"),
    "another's key": ((*TLS, "FOLDER"), "KEY_VALUES_MISMATCH"),
    "no certificate": (TLS[:2], "--tls names the folder"),
    "plain text": (("--scheduler", "tcp://127.0.0.1:1"), "in plain text"),
    "no address": (("--scheduler", "127.0.0.1"), "tls://HOST:PORT"),
    "no workers": (("--scheduler", "local:0"), "1 to 64"),
    "no scheduler": (("--tls", "FOLDER"), "--tls needs --scheduler"),
}


def certificates(lonely: Site, tmp_path: Path, what: str) -> Path:
    """Return a folder of certificates with what is wrong with them, if they are what is wrong."""
    folder = lonely.authority.folder(what.replace(" ", "-").replace("'", ""), days=-1.0 if what == "expired" else 1.0)
    spoilt = {"another authority": "ca.pem", "absent file": "cert.pem", "another's key": "key.pem"}.get(what)
    if spoilt is not None:
        other = Authority(tmp_path, "other").folder("stranger")
        (folder / spoilt).unlink() if what == "absent file" else (folder / spoilt).write_bytes(
            (other / spoilt).read_bytes()
        )
    return folder


@pytest.mark.process
@pytest.mark.parametrize("what", BAD)
def test_bad_input_is_a_line_and_nothing_is_written(
    lonely: Site, rayproof: Rayproof, tmp_path: Path, what: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rayproof.reports.run.engine.cluster.CONNECTING", 3.0)
    monkeypatch.setattr("rayproof.reports.run.engine.cluster.WAIT", 2.0)
    options, says = BAD[what]
    meant = {"ADDRESS": lonely.address, "FOLDER": certificates(lonely, tmp_path, what)}
    options = tuple(meant.get(option, option) for option in options)
    ended = rayproof("run", "primitives/sphere", "--out", tmp_path / "out", *options)

    assert ended.code == 2
    assert says in ended.error
    assert ended.error.count("\n") == 1
    assert not (tmp_path / "out").exists()


def slow_program(folder: Path, *, kills: str = "") -> str:
    """Return a subject that takes a second, draws black, and kills its worker where a scene has this in it.

    The field of view of each scene that it was called for is a line of `calls.log`; after that the process writes the
    file `called.PID`.
    """
    script = folder / "program"
    script.write_text(
        f"""#!{sys.executable}
import json, os, signal, sys, time
if "--capabilities" in sys.argv:
    sys.exit(1)
text = open(sys.argv[1]).read()
with open({str(folder / "calls.log")!r}, "a") as log:
    log.write(str(json.loads(text)["camera"]["fovy"]) + "\\n")
open({str(folder / "called.")!r} + str(os.getpid()), "w").close()
if {kills!r} and {kills!r} in text:
    pid = os.getpid()
    while pid > 1:
        words = open(f"/proc/{{pid}}/cmdline").read()
        if "multiprocessing" in words and "spawn_main" in words:
            os.kill(pid, signal.SIGKILL)
            time.sleep(60)
        pid = int(open(f"/proc/{{pid}}/stat").read().rpartition(")")[2].split()[1])
time.sleep(1)
camera = json.loads(text)["camera"]
with open(sys.argv[2], "wb") as file:
    file.write(b"PF\\n%d %d\\n-1\\n" % (camera["width"], camera["height"]))
    file.write(bytes(12 * camera["width"] * camera["height"]))
"""
    )
    script.chmod(0o755)
    return f"exec:{script} {{scene}} {{output.pfm}}"


def scenes(folder: Path, count: int) -> list[Path]:
    paths = []
    for number in range(count):
        scene = {**SCENE, "camera": {**SCENE["camera"], "fovy": 30 + number}}
        paths.append(folder / f"s{number}.json")
        paths[-1].write_text(json.dumps(scene))
    return paths
