"""A worker may abort, leave or hang; it costs one task, never the run."""

import os
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest

from rayproof.reports.processes.pool import Pool
from rayproof.reports.processes.scratch import PREFIX, scratch
from rayproof.reports.processes.worker import Reply
from tests.reports.run.workers import obey

pytestmark = pytest.mark.process


def replies(
    tasks: list[tuple[str, str]], *, jobs: int = 2, timeout: float = 20.0, copies: dict[str, int] | None = None
) -> dict[tuple[str, str], Reply]:
    """Return the reply to each (kind, task)."""
    pool = Pool(jobs=jobs, timeout=timeout, copies=copies, target=obey)
    futures = {(kind, task): pool.submit(kind, task) for kind, task in tasks}
    try:
        while not pool.idle:
            pool.step()
    finally:
        pool.close()
    return {key: future.result() for key, future in futures.items()}


def submit(pool: Pool, heard: list[Reply], *task: object, **about: object) -> None:
    """Submit a task, whose reply is appended to `heard`."""
    pool.submit(*task, **about).add_done_callback(lambda future: heard.append(future.result()))  # type: ignore[arg-type]


def test_every_task_is_answered_by_a_worker_of_its_kind():
    tasks = [("a", "one"), ("b", "two"), ("a", "three"), ("c", "four")]

    found = replies(tasks)

    assert {key: reply.value for key, reply in found.items()} == {key: key for key in tasks}


@pytest.mark.parametrize(("how", "word"), [("die", "SIGABRT"), ("leave", "exit code 3")])
def test_a_worker_that_dies_costs_its_task_and_is_replaced(how, word):
    found = replies([("a", "before"), ("a", how), ("a", "after")])

    assert found["a", how].value is None
    assert word in (found["a", how].error or "")
    assert found["a", "after"].value == ("a", "after")


def test_a_worker_that_hangs_is_stopped_at_its_deadline():
    found = replies([("a", "hang"), ("a", "after"), ("b", "other")], timeout=3.0)

    assert "3 s" in (found["a", "hang"].error or "")
    assert found["a", "after"].error is None
    assert found["b", "other"].error is None


def test_what_is_first_is_done_in_turn_before_all_else():
    pool = Pool(jobs=1, timeout=20.0, target=obey)
    heard: list[Reply] = []
    for task, first in (("third", False), ("first", True), ("second", True)):
        submit(pool, heard, "a", task, first=first)
    try:
        while not pool.idle:
            pool.step()
    finally:
        pool.close()

    assert [reply.value[1] for reply in heard] == ["first", "second", "third"]


@pytest.mark.parametrize("how", ["one", "die", "leave", "hang"])
def test_nothing_is_left_of_a_worker_s_temporary_files_however_it_ends(how, tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))

    replies([("a", how)], timeout=3.0)

    assert list(tmp_path.iterdir()) == []


def test_a_prepared_worker_s_own_task_comes_first_and_costs_the_others_nothing():
    pool, heard = Pool(jobs=1, timeout=5.0, target=obey), []
    pool.submit("a", "one").add_done_callback(
        lambda future: heard.append((future.result().value, time.monotonic() - start))
    )
    pool.prepare("a", "hang")
    pool.prepare("a", "hang")  # it is prepared already
    start = time.monotonic()
    try:
        while not pool.idle:
            pool.step()
    finally:
        pool.close()

    [(value, seconds)] = heard
    assert value == ("a", "one")
    assert seconds >= 5.0


def test_a_worker_that_dies_when_it_has_nothing_to_do_costs_no_task():
    pool, heard = Pool(jobs=1, timeout=20.0, target=obey), []
    try:
        for task in ("answer and leave", "after"):
            submit(pool, heard, "a", task)
            while not pool.idle:
                pool.step()
            time.sleep(0.5)  # it is dead by now, which nobody waited for
    finally:
        pool.close()

    assert [(reply.value, reply.error) for reply in heard] == [
        (("a", "answer and leave"), None),
        (("a", "after"), None),
    ]


WITH_A_WORKER = """
import sys
from rayproof.reports.processes.pool import SLEEPERS, Pool
from rayproof.reports.processes.scratch import scratch
from tests.reports.run.workers import obey, sleep_or_compute
if __name__ == "__main__":
    with scratch():
        pool = Pool(jobs=1, timeout=60.0, target=obey)
        pool.submit("a", "hang")
        pool.start()
        print(pool._workers["a", 0].process.process.pid, flush=True)
        while True:
            pool.step()
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="prctl of Linux")
def test_workers_end_with_a_parent_that_is_killed_and_the_next_start_sweeps_its_folders(tmp_path, monkeypatch):
    process = subprocess.Popen(
        [sys.executable, "-c", WITH_A_WORKER],
        cwd=Path(__file__).parents[3],
        env={**os.environ, "TMPDIR": str(tmp_path)},
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    worker = psutil.Process(int(process.stdout.readline()))
    process.kill()
    process.communicate()

    assert psutil.wait_procs([worker], timeout=10)[1] == []
    (left,) = tmp_path.iterdir()
    (tmp_path / f"{PREFIX}unmarked").mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    with scratch():
        assert not left.exists()
    assert [path.name for path in tmp_path.iterdir()] == [f"{PREFIX}unmarked"]


def test_large_tasks_run_one_at_a_time_and_their_workers_end_with_them():
    pool = Pool(jobs=3, timeout=30.0, target=obey)
    heard: list[Reply] = []
    for kind in ("a", "b", "a"):
        submit(pool, heard, kind, "pid", large=True)
    most = 0
    try:
        while not pool.idle:
            pool.start()
            most = max(most, len(pool.busy))
            pool.step()
    finally:
        pool.close()

    assert most == 1
    pids = [reply.value for reply in heard]
    assert len(set(pids)) == 3
    assert not any(psutil.pid_exists(pid) for pid in pids)


def pooled(pool: Pool, *tasks: str, **about: object) -> list[Reply]:
    """Return the replies to tasks of one kind, one after the other."""
    found: list[Reply] = []
    try:
        for task in tasks:
            submit(pool, found, "a", task, **about)  # type: ignore[arg-type]
            while not pool.idle:
                pool.step()
    finally:
        pool.close()
    return found


def test_a_worker_that_takes_too_much_memory_is_ended_and_the_next_task_has_another_one():
    pool = Pool(jobs=1, timeout=50.0, target=obey)
    pool.memory = 2**28

    full, after = pooled(pool, "fill", "after")

    assert full.error == "it took more than 0.25 GiB of memory; stopped"
    assert after.value == ("a", "after")
