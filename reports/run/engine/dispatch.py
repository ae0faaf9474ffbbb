"""Batches of cases are submitted to a cluster; lost batches are sent again, in halves if they kill workers.

Dask repeats a batch if its worker was lost. A batch that kills too many workers is sent in halves, each while nothing
else of the run is on the cluster. If a single case kills workers there, its record is an error.
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
WINDOW = 2  # batches sent per worker: the current one, and one in its queue
WORK = 4.0  # s of work in a batch
LARGEST, AHEAD = 200, 2000  # most cases of a batch, and most cases that are read ahead


class Sent(NamedTuple):
    """A batch that was sent to a worker of Dask's choice."""

    future: Any  # Dask's, of an Answer
    cases: Cases
    workers: frozenset[str]  # permitted for it; empty: all
    alone: bool  # nothing else of this run is on the cluster


class Dispatch:
    """The cases of a run on a cluster; `batch` has the options that all batches share.

    The files of finished cases are written to `folder`.
    """

    doing = ()  # the names of the cases are not shown: there are many

    def __init__(self, client: Any, batch: Batch, folder: Path, *, tell: Callable[[str], None]) -> None:
        self._client, self._batch, self._folder, self._tell = client, batch, folder, tell
        self._run, self._facts = uuid.uuid4().hex[:12], facts(batch.options)
        self._futures: dict[str, Future[CaseRecord]] = {}  # of cases under way, by name
        self._waiting: deque[PlannedCase] = deque()
        self._suspects: deque[Cases] = deque()  # batches that killed workers
        self._sent: dict[str, Sent] = {}  # by their futures' keys
        self._done: queue.SimpleQueue[str] = queue.SimpleQueue()
        self._answered = time.monotonic()
        self._looked = self._answered - GLANCE  # so that the first step updates the workers
        self._allowed, self._alone = frozenset[str](), 0.0  # accepted workers, and s without any
        self._refused: dict[str, str] = {}  # other workers, with the reasons
        self._able: set[str] = set()  # workers that answered
        self._pace = 1.0  # s that a worker takes for a case
        self.gone: str | None = None  # why no more work can be done

    @property
    def busy(self) -> dict[str, float]:
        """Return a description of the work, with the time [s] since a worker last answered."""
        cases = sum(len(sent.cases) for sent in self._sent.values())
        return {f"{cases} cases on {len(self._allowed)} workers": time.monotonic() - self._answered}

    @property
    def has_room(self) -> bool:
        """Return whether another case may be submitted; cases are read before they are sent."""
        return len(self._waiting) < AHEAD

    def submit(self, planned: PlannedCase) -> Future[CaseRecord]:
        """Queue a case, and return the future of its record; when it is set, the files are in the folder."""
        self._waiting.append(planned)
        future = self._futures[planned.case.name] = Future[CaseRecord]()
        return future

    def submit_again(self) -> dict[Future[CaseRecord], PlannedCase]:
        """Return nothing: a worker renders cases again before it returns their batch."""
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
        """Cancel all batches, and make the workers end their processes."""
        futures = [sent.future for sent in self._sent.values()]
        self._sent.clear()
        with suppress(Exception):  # they also end without a scheduler
            self._client.cancel(futures, force=True)
            self._client.run(stop, self._run, on_error="ignore", callback_timeout=LATE)

    def record(self) -> EngineRecord:
        """Return the engine's part of results.json."""
        refused: list[RefusedRecord] = [{"id": worker, "why": why} for worker, why in self._refused.items()]
        return {"name": "dask.distributed", "version": version("distributed"), "refused": refused}

    def _look(self) -> None:
        """Update the set of workers; set `gone` if no more work can be done, such as without workers for `WAIT` s."""
        passed, connected = time.monotonic() - self._looked, frozenset[str]()
        self._looked += passed
        # A scheduler that hangs or has gone counts as a scheduler without workers.
        with suppress(OSError, RuntimeError, AttributeError):
            connected = frozenset(self._client.sync(self._client.scheduler.ncores, callback_timeout=LATE))
        self._allowed = connected - self._refused.keys()
        self._alone = 0.0 if self._allowed else self._alone + min(passed, 2 * LATE)  # bounded: Ctrl-Z lengthens it
        for key, sent in [*self._sent.items()]:
            # Queue a batch again if all of its permitted workers are gone: Dask would wait for them.
            if sent.workers and sent.workers.isdisjoint(connected) and sent.future.status == "pending":
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
        """Submit batches until enough were sent; suspects wait until no other batch is in progress."""
        room = WINDOW * len(self._allowed)
        if self._suspects or any(sent.alone for sent in self._sent.values()):
            if room and not self._sent:
                self._send(self._suspects.popleft(), alone=True)
            return
        while self._waiting and len(self._sent) < room:
            # Near the end batches are small, so that the run does not wait for one worker.
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
        """Set the records of a batch as the results of its cases, or queue its cases again."""
        from distributed import KilledWorker

        try:
            answer = sent.future.result(timeout=WAIT)
        except KilledWorker as killed:
            self._take_killed(sent, killed)
            return
        except Exception as error:
            self._waiting.extendleft(sent.cases)
            if sent.future.status == "error":  # else the answer was lost with the worker or the scheduler
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
        if answer.worker in self._able:  # the first batch includes the import of the renderers
            self._pace += 0.3 * (answer.seconds / len(sent.cases) - self._pace)
        self._able.add(answer.worker)
        for planned in sent.cases:
            record = unpacked(answer.finished[planned.case.name], self._folder)
            record["worker"] = answer.worker
            self._futures.pop(planned.case.name).set_result(record)

    def _take_killed(self, sent: Sent, killed: Any) -> None:
        """Queue the halves of a batch that killed workers, or record an error for a case that was sent by itself."""
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
