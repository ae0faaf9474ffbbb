"""A worker may abort, leave or hang; it costs one task, never the run."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest

from rayproof.reports.processes.pool import SLEEPERS, Pool
from rayproof.reports.processes.scratch import PREFIX, scratch
from rayproof.reports.processes.worker import Reply
from tests.reports.run.workers import obey, sleep_or_compute

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


def test_a_kind_with_copies_goes_on_while_one_of_them_hangs():
    found = replies([("a", "hang"), ("a", "one"), ("a", "two")], timeout=3.0, copies={"a": 2})

    assert "3 s" in (found["a", "hang"].error or "")
    assert [found["a", task].error for task in ("one", "two")] == [None, None]


@pytest.mark.parametrize("how", ["one", "die", "leave", "hang"])
def test_nothing_is_left_of_a_worker_s_temporary_files_however_it_ends(how, tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))

    replies([("a", how)], timeout=3.0)

    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("timeout", [1e300, float("inf")])
def test_a_time_limit_beyond_what_systems_count_is_no_limit(timeout):
    assert replies([("a", "one")], timeout=timeout)["a", "one"].error is None


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


@pytest.mark.parametrize("how", ["stop", "stop amid the reply"])
def test_a_worker_that_is_stopped_costs_its_task_at_its_deadline(how):
    found = replies([("a", how), ("a", "after"), ("b", "other")], timeout=3.0)

    assert "3 s" in (found["a", how].error or "")
    assert found["a", "after"].error is None
    assert found["b", "other"].error is None


def test_a_worker_that_was_stopped_before_its_task_came_does_not_stop_who_hands_it_over():
    pool, heard = Pool(jobs=2, timeout=20.0, target=obey), []
    try:
        submit(pool, heard, "a", "one")
        while not pool.idle:
            pool.step()
        pid = pool._workers["a", 0].process.process.pid
        assert pid is not None
        os.kill(pid, signal.SIGSTOP)
        pool._timeout = 2.0
        start = time.monotonic()
        submit(pool, heard, "a", bytes(2**23))
        submit(pool, heard, "b", bytes(2**23))
        while not pool.idle:
            pool.step()
        seconds = time.monotonic() - start
    finally:
        pool.close()

    errors = [reply.error for reply in heard]
    assert "no answer within 2 s; stopped" in errors
    assert seconds < 15.0


def test_eight_megabytes_go_there_and_come_back():
    content = os.urandom(2**23)
    pool, heard = Pool(jobs=1, timeout=60.0, target=obey), []
    try:
        submit(pool, heard, "a", content)
        while not pool.idle:
            pool.step()
    finally:
        pool.close()

    assert [reply.value == content for reply in heard] == [True]


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


def test_a_task_that_is_given_longer_has_longer():
    pool = Pool(jobs=1, timeout=1.0, target=obey)
    heard: list[Reply] = []
    submit(pool, heard, "a", "nap", seconds=30.0)
    submit(pool, heard, "a", "hang", seconds=0.5)
    try:
        while not pool.idle:
            pool.step()
    finally:
        pool.close()

    assert heard[0].error is None
    assert "1 s" in (heard[1].error or "")


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


def test_who_sleeps_takes_no_place_of_those_who_compute():
    pool = Pool(jobs=1, timeout=60.0, target=sleep_or_compute, may_sleep=("sleeps",))
    answered: list[Reply] = []
    for kind, count in (("sleeps", 16), ("computes", 3)):
        for _ in range(count):
            submit(pool, answered, kind, 0.25)
    seen: set[tuple[int, int]] = set()  # how many sleep and how many compute, at once
    try:
        while not pool.idle:
            pool.start()
            busy = [kind for kind, _ in pool._busy()]
            seen.add((busy.count("sleeps"), busy.count("computes")))
            pool.step()
    finally:
        pool.close()

    assert sorted(reply.value for reply in answered) == ["computes"] * 3 + ["sleeps"] * 16
    assert max(sleeping for sleeping, _ in seen) == SLEEPERS
    assert max(computing for _, computing in seen) == 1
    assert any(sleeping and computing for sleeping, computing in seen)


def test_a_slow_worker_does_not_keep_others_waiting_for_its_kind_while_a_processor_has_nothing_to_do(tmp_path):
    pool = Pool(jobs=2, timeout=20.0, target=obey)
    pool.relief = 0.1
    heard: list[Reply] = []
    for _ in range(2):  # the first is done when the second has come
        submit(pool, heard, "slow", tmp_path / "first")
    submit(pool, heard, "busy", "echo")
    spare: set[int] = set()
    try:
        while not pool.idle:
            spare.add(pool.spare())
            pool.step()
    finally:
        pool.close()

    assert [reply.error for reply in heard] == [None] * 3
    assert len(heard) == 3
    assert spare >= {0, 1}  # two at once, and one alone


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


def test_a_worker_that_has_done_many_tasks_is_replaced(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("rayproof.reports.processes.pool.LOOKED_AT", 2)
    monkeypatch.setattr("rayproof.reports.processes.pool.MOST_TASKS", 4)

    pids = [reply.value for reply in pooled(Pool(jobs=1, timeout=50.0, target=obey), *["pid"] * 6)]

    assert len({*pids[:4]}) == len({*pids[4:]}) == 1
    assert pids[3] != pids[4]
