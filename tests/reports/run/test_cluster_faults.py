"""A run on a cluster of which parts are stopped, killed, told to end, or have a full disk; the clusters are real."""

import contextlib
import json
import os
import signal
import sqlite3
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import psutil
import pytest

from rayproof.reports.processes.signals import descendants
from rayproof.reports.results.case_table import NAME as JOURNAL
from tests.harness.soak.disturbing import ENGINE_WORKER, processes
from tests.harness.soak.scenarios import CANNOT_MOUNT, NARROW
from tests.reports.run.test_scheduler import CHECKOUT, found, scenes, site, slow_program

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="signals, limits and mounts of Linux")

# Ctrl-C is heard also where a shell without job control started the tests. A setting that is not there any more is an
# error: it would be made without effect.
HEEDING = """
import importlib, json, signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)
for place, value in json.loads(sys.argv.pop(1)).items():
    module, _, name = place.partition(".")
    module = importlib.import_module(f"rayproof.reports.run.engine.{module}")
    getattr(module, name)
    setattr(module, name, value)
from rayproof.reports.cli import main
sys.exit(main(sys.argv[1:]))
"""


@contextlib.contextmanager
def started(
    folder: Path, *words: object, settings: Mapping[str, float] | None = None, before: tuple[str, ...] = ()
) -> Iterator[subprocess.Popen[str]]:
    """Yield a run whose temporary files are in a folder of their own; `settings` of the engine are made before.

    It is killed where the body leaves it running.
    """
    (folder / "tmp").mkdir(exist_ok=True)
    with subprocess.Popen(
        [*before, sys.executable, "-c", HEEDING, json.dumps(settings or {}), "run", *map(str, words)],
        cwd=CHECKOUT,
        env={**os.environ, "TMPDIR": str(folder / "tmp")},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as process:
        try:
            yield process
        finally:
            process.kill()


def engine_workers(main: subprocess.Popen[str]) -> list[psutil.Process]:
    """Return the engine's workers below a run that have processes of ours below them."""
    alive = descendants(main.pid)
    parents = {one.ppid() for one in alive if one.name().startswith("rayproof-")}
    return [one for one in alive if one.pid in parents - {main.pid}]


def calling(worker: psutil.Process) -> bool:
    """Say whether the slow program renders below a worker. It is asked for its capabilities before: that is no call."""
    programs = [words(one) for one in descendants(worker.pid) if one.name() == "program"]
    return any(one and "--capabilities" not in one for one in programs)


def words(process: psutil.Process) -> list[str]:
    """Return a process's command line; one that has ended has none."""
    try:
        return process.cmdline()
    except psutil.Error:
        return []


def stopped_while_calling(main: subprocess.Popen[str]) -> psutil.Process | None:
    """Stop a worker of a run that renders, and return it if it still did so when it was stopped."""
    for one in filter(calling, engine_workers(main)):
        one.suspend()
        if calling(one):
            return one
        one.resume()
    return None


def eventually(what: Any, seconds: float = 200.0) -> Any:
    """Return the first true value of a function, or the last one after so many seconds."""
    until = time.monotonic() + seconds
    while not (value := what()) and time.monotonic() < until:
        time.sleep(0.1)
    return value


def calls(folder: Path) -> Counter[str]:
    """Return how often the slow program was called for each scene."""
    log = folder / "calls.log"
    return Counter(log.read_text().split() if log.exists() else ())


def called_again(folder: Path) -> set[str]:
    """Return the scenes for which the program was called more often than planned: the first one twice, others once."""
    first = str(min(map(float, calls(folder)), default=0.0))
    return {scene for scene, count in calls(folder).items() if count > (2 if str(float(scene)) == first else 1)}


@pytest.mark.process
def test_a_worker_that_is_stopped_past_its_lifetime_and_returns_is_not_heard_twice(tmp_path: Path) -> None:
    paths = scenes(tmp_path, 15)
    about = ("--subject", slow_program(tmp_path), "--out", tmp_path / "out", "--diagnose", "off")
    settings = {"dispatch.LIFETIME": 4.0, "waiting.LARGEST": 3}
    with started(tmp_path, *paths, *about, "--scheduler", "local:2", "--jobs", 2, settings=settings) as process:
        stopped = eventually(lambda: stopped_while_calling(process))
        assert stopped
        # Its first case is called again, by the other worker, once it was given up: only then does it go on.
        assert eventually(lambda: called_again(tmp_path))
        stopped.resume()
        printed, complaint = process.communicate(timeout=200)

    assert process.returncode == 1, printed + complaint
    assert len(called_again(tmp_path)) == 3, "it went on with its batch, and answered"
    cases = found(tmp_path / "out")
    assert [one["name"] for one in cases] == [f"file/{path.stem}" for path in paths]
    assert {one["verdict"] for one in cases} == {"fail"}
    workers = json.loads((tmp_path / "out" / "results.json").read_text())["engine"]["workers"]
    assert sorted((one["cases"], one["lost"]) for one in workers) == [(0, 1), (15, 0)]


@pytest.mark.process
def test_a_run_that_is_stopped_past_its_workers_lifetime_and_goes_on_loses_none(tmp_path: Path) -> None:
    paths = scenes(tmp_path, 6)
    about = ("--subject", slow_program(tmp_path), "--out", tmp_path / "out", "--diagnose", "off")
    settings = {"dispatch.LIFETIME": 6.0, "waiting.LARGEST": 1}
    with started(tmp_path, *paths, *about, "--scheduler", "local:2", settings=settings) as process:
        assert eventually(lambda: kept(tmp_path / "out"))
        process.send_signal(signal.SIGSTOP)  # as Ctrl-Z does
        time.sleep(8.0)
        process.send_signal(signal.SIGCONT)
        printed, complaint = process.communicate(timeout=200)

    assert (process.returncode, complaint) == (1, ""), printed
    engine = json.loads((tmp_path / "out" / "results.json").read_text())["engine"]
    assert [one["lost"] for one in engine["workers"]] == [0, 0]
    assert len(found(tmp_path / "out")) == len(paths)


@pytest.mark.process
def test_a_scheduler_that_goes_costs_what_was_under_way_and_no_more(tmp_path: Path) -> None:
    paths = scenes(tmp_path, 14)
    about = (*paths, "--subject", slow_program(tmp_path), "--out", tmp_path / "out", "--diagnose", "off")
    largest = 3
    with site(tmp_path / "site") as cluster:
        worker = cluster.worker()
        at = ("--scheduler", cluster.address, *cluster.tls)
        with started(tmp_path, *about, *at, settings={"waiting.LARGEST": largest}) as process:
            eventually(lambda: list((tmp_path / "out").glob("scenes/file/*/*")))
            cluster.scheduler.send_signal(signal.SIGKILL)
            printed, complaint = process.communicate(timeout=100)

        assert (process.returncode, complaint) == (3, "")
        assert printed.count("the scheduler has gone") == 1
        assert json.loads((tmp_path / "out" / "results.json").read_text())["finished"] is False
        first = {one["name"] for one in found(tmp_path / "out")}
        assert 0 < len(first) < len(paths)
        assert eventually(lambda: not below(worker), 60.0), "the worker's processes end with it"

    before = calls(tmp_path)
    with started(tmp_path, *about, "--resume") as again:
        printed, complaint = again.communicate(timeout=200)

    assert (again.returncode, complaint) == (1, "")
    assert len(found(tmp_path / "out")) == len(paths)
    done = calls(tmp_path) - before
    assert len(done) == len(paths) - len(first), "what was finished is not done again"
    assert 0 < sum((before & done).values()) <= 2 * largest, "of what was begun, the batches on their way to the worker"


def below(process: subprocess.Popen[bytes]) -> list[str]:
    """Return the names of our processes that a worker left running."""
    return [one.name() for one in descendants(process.pid) if one.name().startswith("rayproof-")]


@pytest.mark.process
@pytest.mark.parametrize("times", [1, 2])
@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM])
def test_a_run_that_is_told_to_stop_keeps_what_is_finished_and_leaves_nothing(
    tmp_path: Path, how: signal.Signals, times: int
) -> None:
    paths = scenes(tmp_path, 40)
    about = (*paths, "--subject", slow_program(tmp_path), "--out", tmp_path / "out", "--diagnose", "off")
    with started(tmp_path, *about, "--scheduler", "local:2", settings={"waiting.LARGEST": 3}) as process:
        assert eventually(lambda: kept(tmp_path / "out"))
        for _ in range(times):
            # A terminal's Ctrl-C goes to all; who cancels a job tells the one that it started.
            os.killpg(process.pid, how) if how is signal.SIGINT else process.send_signal(how)
            time.sleep(0.3)
        printed, complaint = process.communicate(timeout=60)
        left = eventually(lambda: not running(tmp_path), 10.0) or running(tmp_path)

    assert (process.returncode, complaint) in ((130, ""), (130, "rayproof: interrupted\n"))
    assert left is True
    assert list((tmp_path / "tmp").iterdir()) == []
    finished = kept(tmp_path / "out")
    assert 0 < finished < len(paths)
    if times == 1:
        assert f"interrupted after {finished} of {len(paths)} cases" in printed
        assert len(found(tmp_path / "out")) == finished


def kept(out: Path) -> int:
    """Return how many cases a run's journal holds."""
    try:
        with contextlib.closing(sqlite3.connect(f"file:{out / JOURNAL}?mode=ro", uri=True)) as journal:
            return int(journal.execute("SELECT count(*) FROM cases").fetchone()[0])
    except sqlite3.OperationalError:
        return 0


@pytest.mark.process
@pytest.mark.parametrize(
    ("whom", "how", "ends"),
    [
        ("main", signal.SIGTERM, (130, "rayproof: interrupted\n")),
        (
            "worker",
            signal.SIGABRT,
            (2, "rayproof: --scheduler local:2: no cluster started here: Nanny failed to start.\n"),
        ),
    ],
)
def test_a_cluster_that_is_stopped_while_it_starts_ends_in_one_line(
    tmp_path: Path, whom: str, how: signal.Signals, ends: tuple[int, str]
) -> None:
    with started(tmp_path, "primitives/sphere", "--out", tmp_path / "out", "--scheduler", "local:2") as process:
        workers = eventually(lambda: processes(process.pid).get(ENGINE_WORKER))
        (workers[0] if whom == "worker" else process).send_signal(how)
        _, complaint = process.communicate(timeout=60)

    assert (process.returncode, complaint) == ends
    assert eventually(lambda: not running(tmp_path), 10.0)
    assert list((tmp_path / "tmp").iterdir()) == []
    assert not (tmp_path / "out").exists()


@pytest.mark.process
def test_a_semaphore_that_a_stopped_run_leaves_is_removed_without_a_word() -> None:
    code = """
import os
from multiprocessing import get_context
from rayproof.reports.run.engine import cluster
cluster._start_tracker()
left = get_context("spawn").Lock()
os._exit(130)
"""
    ended = subprocess.run([sys.executable, "-c", code], cwd=CHECKOUT, capture_output=True, text=True, timeout=60)

    assert (ended.returncode, ended.stderr) == (130, "")


@pytest.mark.process
def test_a_run_that_is_killed_leaves_nothing_running_though_its_workers_are_stopped(tmp_path: Path) -> None:
    about = (*scenes(tmp_path, 9), "--subject", slow_program(tmp_path), "--out", tmp_path / "out", "--diagnose", "off")
    with started(tmp_path, *about, "--scheduler", "local:2") as process:
        workers = eventually(lambda: engine_workers(process))
        for one in workers:
            one.suspend()

    assert workers
    assert eventually(lambda: not running(tmp_path), 10.0)


def running(folder: Path) -> list[psutil.Process]:
    """Return the processes whose temporary files are below a folder."""
    place = str(folder / "tmp")
    return [one for one in psutil.process_iter(["environ"]) if place in ((one.info["environ"] or {}).get("TMPDIR", ""))]


def narrow(where: Path, size: str, *, again: bool = False) -> tuple[str, ...]:
    """Return the words before a command that sees a full file system at a place, and nobody else does."""
    where.mkdir()
    unshare = ("unshare", "--mount", *(() if os.geteuid() == 0 else ("--user", "--map-root-user")))
    return (*unshare, "sh", "-c", NARROW, "sh", size, str(where), "rw", "again" if again else "once")


@pytest.mark.process
def test_a_full_disk_of_the_run_is_one_line_and_resuming_is_exact(tmp_path: Path) -> None:
    paths = scenes(tmp_path, 6)
    about = (*paths, "--subject", slow_program(tmp_path), "--out", tmp_path / "out", "--diagnose", "off")
    before = narrow(tmp_path / "out", "96k", again=True)  # room for the journal, not for what six cases return
    with started(tmp_path, *about, "--scheduler", "local:2", settings={"waiting.LARGEST": 2}, before=before) as process:
        printed, complaint = process.communicate(timeout=280)

    if process.returncode == CANNOT_MOUNT or "unshare:" in complaint:
        pytest.skip("this user may mount nothing")
    assert process.returncode == 0, printed + complaint  # which is: 3, and then 1 with room
    assert complaint.startswith(f"rayproof: {tmp_path / 'out'}")
    assert complaint.count("\n") == 1
    assert "--resume goes on" in complaint
    cases = json.loads((tmp_path / "out.json").read_text())["cases"]
    assert [one["name"] for one in cases] == [f"file/{path.stem}" for path in paths]
    assert {one["verdict"] for one in cases} == {"fail"}
    assert eventually(lambda: not running(tmp_path), 10.0)
    assert list((tmp_path / "tmp").iterdir()) == []


@pytest.mark.process
def test_a_worker_whose_disk_is_full_gets_no_more_work(tmp_path: Path) -> None:
    paths = scenes(tmp_path, 6)
    about = (*paths, "--subject", slow_program(tmp_path), "--out", tmp_path / "out", "--diagnose", "off")
    with site(tmp_path / "site") as cluster:
        full = cluster.worker(before=narrow(tmp_path / "full", "16k"), TMPDIR=str(tmp_path / "full"))
        cluster.worker()
        at = ("--scheduler", cluster.address, *cluster.tls)
        with started(tmp_path, *about, *at, settings={"waiting.LARGEST": 2}) as process:
            printed, complaint = process.communicate(timeout=250)
        if full.poll() == CANNOT_MOUNT or full.poll() == 1:
            pytest.skip("this user may mount nothing")

    assert process.returncode == 1, printed + complaint
    assert complaint.endswith("gets no work: OSError: [Errno 28] No space left on device\n")
    assert complaint.count("\n") == 1
    assert {one["verdict"] for one in found(tmp_path / "out")} == {"fail"}
    engine = json.loads((tmp_path / "out" / "results.json").read_text())["engine"]
    assert sorted(one["cases"] for one in engine["workers"]) == [0, 6]
    assert len(engine["refused"]) == 1


@pytest.mark.process
def test_a_scheduler_that_hangs_is_not_waited_for_forever(tmp_path: Path) -> None:
    about = (*scenes(tmp_path, 9), "--subject", slow_program(tmp_path), "--out", tmp_path / "out", "--diagnose", "off")
    with site(tmp_path / "site") as cluster:
        cluster.worker()
        at = ("--scheduler", cluster.address, *cluster.tls)
        with started(
            tmp_path, *about, *at, settings={"dispatch.LIFETIME": 5.0, "dispatch.WAIT": 20.0, "waiting.LARGEST": 2}
        ) as process:
            assert eventually(lambda: kept(tmp_path / "out"))
            cluster.scheduler.send_signal(signal.SIGSTOP)
            printed, complaint = process.communicate(timeout=120)

    assert (process.returncode, complaint) == (3, "")
    assert "no worker is left, and no other one came within 20 s" in printed
    assert json.loads((tmp_path / "out" / "results.json").read_text())["finished"] is False
    assert len(found(tmp_path / "out")) == kept(tmp_path / "out")


@pytest.mark.process
def test_a_program_that_hangs_floods_and_forks_is_ended_on_a_worker_with_all_its_children(tmp_path: Path) -> None:
    (path,) = scenes(tmp_path, 1)
    nap = f"86397.{os.getpid()}"  # s; no other process sleeps as long, nor another run of this test
    script = tmp_path / "render"
    script.write_text(
        f'#!/bin/sh\n[ "$1" = --capabilities ] && exit 1\nyes | head -c 30000000\nyes | head -c 30000000 >&2\n'
        f"setsid sleep {nap} &\nexec sleep {nap}\n"
    )
    script.chmod(0o755)

    def sleeping() -> list[psutil.Process]:
        return [one for one in psutil.process_iter(["cmdline"]) if nap in (one.info["cmdline"] or ())[1:2]]

    about = (path, "--subject", f"exec:{script} {{scene}} {{output}}", "--timeout", 5, "--out", tmp_path / "out")
    with site(tmp_path / "site") as cluster:
        worker = cluster.worker()
        with started(tmp_path, *about, "--scheduler", cluster.address, *cluster.tls) as process:
            begun = eventually(sleeping)
            printed, complaint = process.communicate(timeout=200)

        assert begun
        assert process.returncode == 3, printed + complaint
        assert [one["verdict"] for one in found(tmp_path / "out")] == ["error"]
        assert "5 s" in found(tmp_path / "out")[0]["reason"]
        assert sleeping() == []
        assert worker.poll() is None
        assert eventually(lambda: not below(worker), 10.0), "the run is over for its worker, too"
