"""A worker may abort, leave or hang; it costs one task, never the run."""

import time

import pytest

from reports.run.pool import Pool
from reports.run.worker import Reply
from tests.reports.run.workers import obey


def replies(
    tasks: list[tuple[str, str]], *, jobs: int = 2, timeout: float = 20.0, copies: dict[str, int] | None = None
) -> dict[tuple[str, str], Reply]:
    """Return the reply to each (kind, task)."""
    pool = Pool(jobs=jobs, timeout=timeout, copies=copies, target=obey)
    found: dict[tuple[str, str], Reply] = {}
    for kind, task in tasks:
        pool.submit(kind, task, lambda reply, key=(kind, task): found.__setitem__(key, reply))
    try:
        while not pool.idle:
            pool.step()
    finally:
        pool.close()
    return found


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
    heard: list[str] = []
    for task, first in (("third", False), ("first", True), ("second", True)):
        pool.submit("a", task, lambda reply: heard.append(reply.value[1]), first=first)
    try:
        while not pool.idle:
            pool.step()
    finally:
        pool.close()

    assert heard == ["first", "second", "third"]


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
    pool.submit("a", "one", lambda reply: heard.append((reply.value, time.monotonic() - start)))
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
            pool.submit("a", task, heard.append)
            while not pool.idle:
                pool.step()
            time.sleep(0.5)  # it is dead by now, which nobody waited for
    finally:
        pool.close()

    assert [(reply.value, reply.error) for reply in heard] == [
        (("a", "answer and leave"), None),
        (("a", "after"), None),
    ]
