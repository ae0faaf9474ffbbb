"""A run on a cluster of which parts are stopped, killed or told to end; the clusters are real."""

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
from functools import partial
from pathlib import Path
from typing import Any

import psutil
import pytest

from rayproof.reports.processes.signals import descendants
from rayproof.reports.results.case_table import NAME as JOURNAL
from tests.reports.run.test_scheduler import CHECKOUT, found, scenes, slow_program

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
    folder: Path, *words: object, settings: Mapping[str, float] | None = None
) -> Iterator[subprocess.Popen[str]]:
    """Yield a run whose temporary files are in a folder of their own; `settings` of the engine are made before.

    It is killed where the body leaves it running.
    """
    (folder / "tmp").mkdir(exist_ok=True)
    with subprocess.Popen(
        [sys.executable, "-c", HEEDING, json.dumps(settings or {}), "run", *map(str, words)],
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


def shown(process: psutil.Process) -> tuple[str, list[str]]:
    """Return a process's name and command line; one that has ended has none."""
    try:
        return process.name(), process.cmdline()
    except psutil.Error:
        return "", []


def below(pid: int) -> list[str]:
    """Return the names of our processes below another one."""
    return [name for name, _ in map(shown, descendants(pid)) if name.startswith("rayproof-")]


def engine_workers(main: subprocess.Popen[str]) -> list[psutil.Process]:
    """Return Dask's workers below a run that have processes of ours below them."""
    return [one for one in descendants(main.pid) if below(one.pid)]


def calling(worker: psutil.Process) -> bool:
    """Say whether the slow program renders below a worker. It is asked for its capabilities before: that is no call."""
    return any(
        name == "program" and "--capabilities" not in words for name, words in map(shown, descendants(worker.pid))
    )


def logged(folder: Path, worker: psutil.Process) -> bool:
    """Return whether a call of the slow program that runs below a worker has been logged."""
    return any((folder / f"called.{process.pid}").exists() for process in descendants(worker.pid))


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


@pytest.mark.process
@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGSTOP])
def test_what_a_worker_had_that_dies_or_hangs_is_done_by_others(tmp_path: Path, how: signal.Signals) -> None:
    paths = scenes(tmp_path, 9)
    about = ("--subject", slow_program(tmp_path), "--out", tmp_path / "out", "--diagnose", "off")
    settings = {"cluster.LIFETIME": 5.0}  # s, the least that Dask takes
    with started(tmp_path, *paths, *about, "--scheduler", "local:2", "--jobs", 2, settings=settings) as process:
        worker = eventually(lambda: next(filter(partial(logged, tmp_path), engine_workers(process)), None))
        worker.send_signal(how)
        printed, complaint = process.communicate(timeout=200)

    assert (process.returncode, complaint) == (1, ""), printed
    cases = found(tmp_path / "out")
    assert [one["name"] for one in cases] == [f"file/{path.stem}" for path in paths]
    assert {one["verdict"] for one in cases} == {"fail"}
    assert calls(tmp_path).total() > len(paths) + 1, "what it had begun was begun again; one case is called twice"


@pytest.mark.process
@pytest.mark.parametrize(("how", "times"), [(signal.SIGINT, 1), (signal.SIGINT, 2), (signal.SIGTERM, 1)])
def test_a_run_that_is_told_to_stop_keeps_what_is_finished_and_leaves_nothing(
    tmp_path: Path, how: signal.Signals, times: int
) -> None:
    paths = scenes(tmp_path, 40)
    about = (*paths, "--subject", slow_program(tmp_path), "--out", tmp_path / "out", "--diagnose", "off")
    with started(tmp_path, *about, "--scheduler", "local:2", settings={"dispatch.LARGEST": 3}) as process:
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


def running(folder: Path) -> list[psutil.Process]:
    """Return the processes whose temporary files are below a folder."""
    place = str(folder / "tmp")
    return [one for one in psutil.process_iter(["environ"]) if place in ((one.info["environ"] or {}).get("TMPDIR", ""))]
