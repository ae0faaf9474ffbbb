"""What becomes of the cases of a cluster's workers that die, hang, raise or answer late; a cluster is played here."""

from collections import deque
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from rayproof.cases.families import select
from rayproof.reports.run.case import Terms
from rayproof.reports.run.engine import dispatch as module
from rayproof.reports.run.engine import machine, vetting
from rayproof.reports.run.engine.batch import Answer, Batch, Limits, packed
from rayproof.reports.run.engine.cluster import ClusterError, Event, WorkerState
from rayproof.reports.run.engine.dispatch import Dispatch
from rayproof.reports.run.engine.facts import Facts
from rayproof.reports.run.engine.vetting import Vetting
from rayproof.reports.run.options import EVERY_CASE, Demands
from rayproof.reports.run.plan import PlannedCase
from rayproof.reports.subjects import THE_TRACER

CASE = select(["primitives/sphere"])[0]
DEMANDS = Demands(subject="tracer", identity=(), references=("analytic",), require=(), images=EVERY_CASE, own=())
TERMS = Terms(demands=DEMANDS, subject=THE_TRACER, cached=False, patient=False)
LIMITS = Limits(timeout=60.0, jobs=1)
RECORD: dict[str, Any] = {
    "name": "played/0", "family": "played", "verdict": "pass", "renders": [], "planned": 0, "checks": [], "ran": {},
    "covers": [],
}  # fmt: skip
FACTS = Facts(told={"Python": "3"}, model="any")


def planned(number: int) -> PlannedCase:
    return PlannedCase(case=replace(CASE, name=f"played/{number}"), configurations=("float32",))


class Played:
    """A cluster of workers who do what `behaviour` says of a batch: answer, die, raise or say nothing."""

    version, alive = "played", True

    def __init__(self, folder: Path, count: int, behaviour: Callable[[Batch], str]) -> None:
        self._folder, self._behaviour = folder, behaviour
        self._born = 0
        self.there: dict[str, WorkerState] = {}
        self.events: deque[Event] = deque()
        self._queues: dict[str, deque[tuple[str, Batch]]] = {}
        self.late: list[Event] = []
        self.forgotten: set[str] = set()
        self.most_waiting = 0
        for _ in range(count):
            self.born()

    def born(self) -> None:
        self._born += 1
        self.there[f"tls://played:{self._born}"] = WorkerState(name=str(self._born), host="played", last_seen=0.0)

    def send(self, task: str, function: Any, *arguments: Any, worker: str) -> None:
        if function is machine.tell:
            self.events.append(Event(task=task, value=(FACTS, 1)))
            return
        if worker in self.there:  # of others nobody ever hears again
            self._queues.setdefault(worker, deque()).append((task, arguments[0]))
            self.most_waiting = max(self.most_waiting, len(self._queues[worker]))

    def forget(self, task: str) -> None:
        self.forgotten.add(task)
        for queue in self._queues.values():
            for one in [one for one in queue if one[0] == task]:
                queue.remove(one)

    def tell_all(self, function: Any, *arguments: Any) -> None:
        assert function is machine.stop

    def next(self, seconds: float) -> Event | None:
        if self.events:
            return self.events.popleft()
        for address, queue in list(self._queues.items()):
            if not queue or address not in self.there:
                continue
            task, batch = queue.popleft()
            does = self._behaviour(batch)
            if does == "die":
                # Whatever waited there is lost with it, and another one comes in its place.
                del self.there[address], self._queues[address]
                self.born()
            elif does == "raise":
                return Event(task=task, error=OSError(28, "No space left on device"))
            else:
                answer = Event(task=task, value=Answer(finished=tuple(map(self._case, batch.cases)), seconds=1.0))
                if does == "answer":
                    return answer
                self.late.append(answer)
        return Event(task="", value=dict(self.there))

    def _case(self, one: PlannedCase) -> Any:
        record = {**RECORD, "name": one.case.name}
        return packed(one.case.name, record, self._folder)


def put_through(cluster: Played, cases: list[PlannedCase], folder: Path) -> tuple[list[dict[str, Any]], Dispatch]:
    """Return the records in the order in which they came."""
    vetting = Vetting(cluster, TERMS, LIMITS, tell=lambda line: None)
    vetting.wait(5.0)
    dispatch = Dispatch(cluster, TERMS, LIMITS, vetting, patience=0.05)
    records: list[dict[str, Any]] = []
    dispatch.put_through(
        cases,
        folder=folder,
        finished=lambda one, record: records.append(record),
        enough=lambda: False,
        glance=lambda: None,
    )
    dispatch.close()
    return records, dispatch


@pytest.fixture(autouse=True)
def _as_here(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(vetting, "facts", lambda terms: FACTS)


def test_who_kills_workers_is_an_error_and_no_innocent_neighbour_is(tmp_path: Path) -> None:
    def kills(batch: Batch) -> str:
        return "die" if any(one.case.name == "played/30" for one in batch.cases) else "answer"

    cluster = Played(tmp_path, 2, kills)
    records, dispatch = put_through(cluster, [planned(number) for number in range(61)], tmp_path)

    assert sorted(record["name"] for record in records) == sorted(f"played/{number}" for number in range(61))
    wrong = [record for record in records if record["verdict"] != "pass"]
    assert [record["name"] for record in wrong] == ["played/30"]
    assert wrong[0]["verdict"] == "error"
    assert wrong[0]["reason"].count("it left the cluster") == 2
    told = dispatch.record()
    assert told["split"] > 0
    assert sum(worker["cases"] for worker in told["workers"]) == 60
    assert cluster.most_waiting <= module.WINDOW


def test_a_late_answer_is_not_taken_twice(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "LIFETIME", 0.3)
    first: list[str] = []

    def sleeps(batch: Batch) -> str:
        first.append(batch.name)
        return "answer" if len(first) > 2 else "say nothing"

    cluster = Played(tmp_path, 1, sleeps)
    once = cluster.next

    def next_and_late(seconds: float) -> Event | None:
        event = once(seconds)
        if event is not None and event.task not in first and len(cluster.there) == 1 and len(first) >= 2:
            cluster.born()  # a second worker; the first one is still listed, and silent
        alive = list(cluster.there)[1:]
        for address in alive:
            cluster.there[address] = replace(cluster.there[address], last_seen=cluster.there[address].last_seen + 1)
        given_up = [late for late in cluster.late if late.task in cluster.forgotten]
        cluster.events.extend(given_up)
        cluster.late = [late for late in cluster.late if late not in given_up]
        return event

    monkeypatch.setattr(cluster, "next", next_and_late)
    records, dispatch = put_through(cluster, [planned(number) for number in range(40)], tmp_path)

    assert sorted(record["name"] for record in records) == sorted(f"played/{number}" for number in range(40))
    assert not cluster.late, "both late answers came"
    assert dispatch.record()["workers"][0]["lost"] == 1


def test_a_worker_that_raises_gets_no_more_work_and_the_run_stops_where_none_is_left(tmp_path: Path) -> None:
    records, dispatch = put_through(Played(tmp_path, 2, lambda batch: "raise"), [planned(0), planned(1)], tmp_path)

    assert records == []
    assert dispatch.gone is not None
    assert "no worker is left" in dispatch.gone
    assert [one["why"] for one in dispatch.record()["refused"]] == ["OSError: [Errno 28] No space left on device"] * 2


def test_a_worker_that_differs_is_named_with_the_first_difference(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    ours = Facts(told={"Python": "3", "processor features": "avx2 avx512f fma"}, model="any")
    theirs = Facts(told={"Python": "3", "processor features": "avx2 fma"}, model="any")
    monkeypatch.setattr(vetting, "facts", lambda terms: ours)
    monkeypatch.setitem(globals(), "FACTS", theirs)
    cluster = Played(tmp_path, 1, lambda batch: "answer")

    with pytest.raises(ClusterError, match=r"tls://played:1: processor features: no more there, avx512f here"):
        Vetting(cluster, TERMS, LIMITS, tell=lambda line: None).wait(5.0)
