"""Batches of cases are submitted to a cluster; lost ones are sent again, in halves or alone.

Dask does a batch again whose worker was lost. One of which too many workers die is sent in halves, each alone on the
cluster, and a case of which workers die there is an error.
"""

import pickle
import queue
import time
import uuid
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

from rayproof.reports.processes.pool import Future
from rayproof.reports.processes.worker import Reply
from rayproof.reports.results.case_records import CaseRecord
from rayproof.reports.results.records import EngineRecord, RefusedRecord
from rayproof.reports.run.case_record import unjudged
from rayproof.reports.run.engine.cluster import WAIT
from rayproof.reports.run.engine.machine import GLANCE, Batch, Cases, facts, stop, unpacked, work
from rayproof.reports.run.plan import PlannedCase

LATE = 5.0  # s that a scheduler may take to answer
WINDOW = 2  # batches on their way for each worker: one that it does, and one that waits there
WORK = 4.0  # s that a worker has with a batch
LARGEST, AHEAD = 200, 2000  # cases of a batch, and that are read before they are sent


class Sent(NamedTuple):
    """A batch on its way to a worker of Dask's choice."""

    future: Any  # Dask's, of an Answer
    cases: Cases
    workers: frozenset[str]  # among which Dask chooses; empty: all
    alone: bool  # nothing else of this run is on the cluster


class Dispatch:
    """Put the cases of a run through a cluster; `batch` is what its batches have in common.

    The files of finished cases are written to `folder`.
    """

    doing = ()  # the names of the cases are not shown: there are many

    def __init__(self, client: Any, batch: Batch, folder: Path, *, tell: Callable[[str], None]) -> None:
        self._client, self._batch, self._folder, self._tell = client, batch, folder, tell
        self._run, self._facts = uuid.uuid4().hex[:12], facts(batch.options)
        self._futures: dict[str, Future[CaseRecord]] = {}  # of cases under way, by name
        self._waiting: deque[PlannedCase] = deque()
        self._suspects: deque[Cases] = deque()  # of which workers died
        self._sent: dict[str, Sent] = {}  # by their futures' keys
        self._done: queue.SimpleQueue[str] = queue.SimpleQueue()
        self._answered = time.monotonic()
        self._looked = self._answered - GLANCE  # so that the first step looks
        self._allowed, self._alone = frozenset[str](), 0.0  # workers that may have work, and s that there was none
        self._refused: dict[str, str] = {}  # other workers, and why
        self._able: set[str] = set()  # workers that answered
        self._pace = 1.0  # s that a worker takes for a case
        self.gone: str | None = None  # why no more work can be done

    @property
    def busy(self) -> dict[str, float]:
        """Return what is being done, and for how long [s] no worker has answered."""
        cases = sum(len(sent.cases) for sent in self._sent.values())
        return {f"{cases} cases on {len(self._allowed)} workers": time.monotonic() - self._answered}

    @property
    def has_room(self) -> bool:
        """Say whether another case may be submitted: some are read before they are sent."""
        return len(self._waiting) < AHEAD

    def submit(self, planned: PlannedCase) -> Future[CaseRecord]:
        """Have a case wait for a worker, and return the future of its record, whose files are in the folder then."""
        self._waiting.append(planned)
        future = self._futures[planned.case.name] = Future[CaseRecord]()
        return future

    def submit_again(self) -> dict[Future[CaseRecord], PlannedCase]:
        """Return nothing: a worker asks again about the cases of its batch before it returns them."""
        return {}

    def step(self) -> None:
        """Send batches, and wait a little for the results of one."""
        if time.monotonic() - self._looked >= GLANCE:
            self._look()
        if self.gone is not None:
            return
        self._hand_out()
        with suppress(queue.Empty):
            if (sent := self._sent.pop(self._done.get(timeout=GLANCE), None)) is not None:
                self._take(sent)

    def close(self) -> None:
        """Let everything go that is on its way, and have the workers end their processes."""
        futures = [sent.future for sent in self._sent.values()]
        self._sent.clear()
        with suppress(Exception):  # a scheduler that has gone ends them, too
            self._client.cancel(futures, force=True)
            self._client.run(stop, self._run, on_error="ignore", callback_timeout=LATE)

    def record(self) -> EngineRecord:
        """Return what the results say of the engine."""
        refused: list[RefusedRecord] = [{"id": worker, "why": why} for worker, why in self._refused.items()]
        return {"name": "dask.distributed", "version": version("distributed"), "refused": refused}

    def _look(self) -> None:
        """Look which workers there are; `gone` is set where there has been none for long."""
        passed, there = time.monotonic() - self._looked, frozenset[str]()
        self._looked += passed
        with suppress(OSError, RuntimeError, AttributeError):  # a scheduler that hangs or has gone has no workers
            there = frozenset(self._client.sync(self._client.scheduler.ncores, callback_timeout=LATE))
        self._allowed = there - self._refused.keys()
        self._alone = 0.0 if self._allowed else self._alone + min(passed, 2 * LATE)  # which Ctrl-Z makes longer
        for key, sent in [*self._sent.items()]:
            # Dask would wait for workers that it was told to choose among.
            if sent.workers and sent.workers.isdisjoint(there) and sent.future.status == "pending":
                self._client.cancel([self._sent.pop(key).future], force=True)
                self._waiting.extendleft(sent.cases)
        first = next((f": {worker}: {why}" for worker, why in self._refused.items()), "")
        if self._client.status != "running":
            self.gone = "the scheduler has gone"
        elif first and not self._allowed and not self._able:
            self.gone = f"no worker may have work{first}"
        elif self._alone > WAIT:
            self.gone = f"no worker is left, and no other one came within {WAIT:g} s{first}"

    def _hand_out(self) -> None:
        """Submit batches until enough are on their way; suspects wait until nothing else is."""
        room = WINDOW * len(self._allowed)
        if self._suspects or any(sent.alone for sent in self._sent.values()):
            if room and not self._sent:
                self._send(self._suspects.popleft(), alone=True)
            return
        while self._waiting and len(self._sent) < room:
            # Near the end batches are small, so that nobody waits for one worker.
            size = max(1, int(min(LARGEST, WORK / self._pace, len(self._waiting) / room)))
            self._send(tuple(self._waiting.popleft() for _ in range(size)), alone=False)

    def _send(self, cases: Cases, *, alone: bool) -> None:
        pickled = pickle.dumps(replace(self._batch, cases=cases))
        workers = self._allowed if self._refused else frozenset[str]()
        about = {"workers": sorted(workers) or None, "pure": False, "retries": 0}
        future = self._client.submit(work, self._run, self._facts, pickled, **about)
        self._sent[future.key] = Sent(future, cases, workers, alone)
        future.add_done_callback(lambda done: self._done.put(done.key))

    def _take(self, sent: Sent) -> None:
        """Set the records of a batch as the results of its cases, or have its cases wait again."""
        from distributed import KilledWorker

        try:
            answer = sent.future.result(timeout=WAIT)
        except KilledWorker as killed:
            self._take_killed(sent, killed)
            return
        except Exception as error:
            self._waiting.extendleft(sent.cases)
            if sent.future.status == "error":  # else its answer was lost with its worker, or with the scheduler
                self.gone = f"a worker cannot read a batch: {type(error).__name__}: {' '.join(str(error).split())}"
            return
        if answer.refused:
            self._waiting.extendleft(sent.cases)
            if answer.worker not in self._refused:
                self._refused[answer.worker] = answer.refused
                self._tell(f"worker {answer.worker} gets no work: {answer.refused}")
            self._allowed -= {answer.worker}
            return
        self._answered = time.monotonic()
        if answer.worker in self._able:  # else it imported its renderers, too
            self._pace += 0.3 * (answer.seconds / len(sent.cases) - self._pace)
        self._able.add(answer.worker)
        for planned in sent.cases:
            record = unpacked(answer.finished[planned.case.name], self._folder)
            record["worker"] = answer.worker
            self._futures.pop(planned.case.name).set_result(record)

    def _take_killed(self, sent: Sent, killed: Any) -> None:
        """Take up a batch of which workers died: in halves, or as an error of the case that was alone with them."""
        middle, address = len(sent.cases) // 2, killed.last_worker.address
        if middle or not sent.alone:
            self._suspects.extend(half for half in (sent.cases[:middle], sent.cases[middle:]) if half)
            return
        why = f"{killed.allowed_failures + 1} workers died that had nothing else to do, the last of them {address}"
        reply, subject = Reply(value=None, error=why, trace=None, seconds=0.0), self._batch.options.subject
        record = unjudged(sent.cases[0].case, (), (), reply, folder=self._folder, subject=subject)
        record.update({"reason": why, "worker": address, "versions": {}, "remembered": False})
        record.update({"seconds": 0.0, "judge_seconds": 0.0})
        self._futures.pop(sent.cases[0].case.name).set_result(record)
