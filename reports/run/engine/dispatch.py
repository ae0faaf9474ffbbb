"""Handing out batches of cases to the workers of a cluster, and taking up what becomes of them.

Few batches are on their way, so that a scheduler never holds a long run. A batch has a few seconds of work, as measured
so far, and a worker gets cases of one structure after each other, whose kernels it has. A worker that is lost costs
what it was doing, nobody else's: its batches are split and sent again, each then alone on a worker, and a case that
loses two workers alone is an error.
"""

import itertools
import time
import uuid
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from rayproof.reports.judge.answers import Answers
from rayproof.reports.processes.worker import Reply
from rayproof.reports.results.case_records import CaseRecord
from rayproof.reports.results.records import EngineRecord
from rayproof.reports.run.case import Terms
from rayproof.reports.run.case_record import unjudged
from rayproof.reports.run.engine import machine
from rayproof.reports.run.engine.batch import Batch, Limits, unpacked, write
from rayproof.reports.run.engine.cluster import Cluster, Event, Place, reached
from rayproof.reports.run.engine.vetting import GLANCE, LIFETIME, Vetting, Worker
from rayproof.reports.run.engine.waiting import Structure, Waiting
from rayproof.reports.run.plan import PlannedCase
from rayproof.reports.run.scenes import estimate
from rayproof.tracer.kernel.compiler import choose_packaged_llvm

WAIT = 60.0  # s for a worker that may have work
WINDOW = 2  # batches on their way to a worker: one that it does, and one that waits there
WORK = 4.0  # s that a worker has with a batch
LOSSES = 2  # workers that a case alone may cost


@dataclass(frozen=True, kw_only=True)
class Sent:
    """A batch on its way."""

    batch: Batch
    worker: str
    alone: bool  # nothing else is on its way to that worker
    estimated: float  # s of one processor


@dataclass(kw_only=True)
class Story:
    """What happened to a case before it was finished."""

    attempts: int = 0
    ends: list[str] = field(default_factory=list)  # how the workers ended that it lost alone


class Dispatch:
    """Put the cases of a run through a cluster, by workers that would find what this machine finds.

    Where none is left, another one may come within `patience` seconds.
    """

    def __init__(self, cluster: Cluster, terms: Terms, limits: Limits, vetting: Vetting, *, patience: float) -> None:
        self._cluster, self._terms, self._limits = cluster, terms, limits
        self._vetting, self._patience = vetting, patience
        self._folder = Path()
        self._record: Callable[[PlannedCase, CaseRecord], None] = lambda one, record: None
        self._alone_since: float | None = None  # when the last worker had gone
        self._answered = time.monotonic()  # when the last answer came
        self.run = uuid.uuid4().hex[:12]
        self._numbers = itertools.count()
        self._sent: dict[str, Sent] = {}
        self._again: deque[tuple[PlannedCase, ...]] = deque()  # lost before: each goes alone
        self._stories: dict[str, Story] = {}
        self._rate = 1.0 / max(1, limits.jobs or 1)  # s that a worker takes for an estimated second
        self.batches = self.resent = self.split = 0
        self.gone: str | None = None  # why no more work can be done

    @property
    def under_way(self) -> list[str]:
        """Return the names of the cases that workers have."""
        return [one.case.name for sent in self._sent.values() for one in sent.batch.cases]

    @property
    def busy(self) -> dict[str, float]:
        """Return what is being done, and for how long [s] no worker has answered."""
        workers = sum(bool(one.sent) for one in self._vetting.workers.values())
        return {f"{len(self.under_way)} cases on {workers} workers": time.monotonic() - self._answered}

    def put_through(
        self,
        cases: Iterable[PlannedCase],
        *,
        folder: Path,
        finished: Callable[[PlannedCase, CaseRecord], None],
        enough: Callable[[], bool],
        glance: Callable[[], None],
    ) -> None:
        """Put all cases through, until there are no more, `enough` says so, or nobody is left to do them.

        `finished` gets each with its record, whose files are in `folder` by then; `glance` is called now and then.
        """
        self._folder, self._record = folder, finished
        waiting = Waiting(iter(cases))
        while (waiting or self._again or self._sent) and self.gone is None and not enough():
            self._hand_out(waiting)
            glance()
            event = self._cluster.next(GLANCE)
            if event is not None:
                self._take(event)
            self._lose_the_silent()
            now = time.monotonic()
            self._alone_since = None if self._vetting.workers else self._alone_since or now
            if self._alone_since is not None and now - self._alone_since > self._patience:
                self.gone = f"no worker is left, and no other one came within {self._patience:g} s"

    def close(self) -> None:
        """Let everything go that is on its way, and have the workers end their processes."""
        for name in list(self._sent):
            self._cluster.forget(name)
        self._sent.clear()
        self._cluster.tell_all(machine.stop, self.run)

    def record(self) -> EngineRecord:
        """Return what the results say of the engine."""
        return {
            "name": "dask.distributed",
            "version": self._cluster.version,
            "workers": [one.record() for one in self._vetting.ever],
            "batches": self.batches,
            "resent": self.resent,
            "split": self.split,
            "refused": self._vetting.refused,
        }

    def _hand_out(self, waiting: Waiting) -> None:
        for worker in [one for one in self._vetting.workers.values() if one.told]:
            while self._again and not worker.sent:
                self._send(worker, self._again.popleft(), alone=True)
            while waiting and not any(self._sent[name].alone for name in worker.sent) and len(worker.sent) < WINDOW:
                # Near the end small batches, so that nobody waits for one worker.
                share = WORK if waiting.more else min(WORK, self._seconds(waiting.all) / (WINDOW * self._vetting.count))
                cases, worker.structure = waiting.take(worker.structure, share, self._seconds, self._taken)
                self._send(worker, cases, alone=False)

    @property
    def _taken(self) -> set[Structure | None]:
        """Return the structures that workers have kernels of."""
        return {one.structure for one in self._vetting.workers.values()}

    def _send(self, worker: Worker, cases: tuple[PlannedCase, ...], *, alone: bool) -> None:
        name = f"rayproof-{self.run}-{next(self._numbers)}"
        batch = Batch(name=name, run=self.run, terms=self._terms, limits=self._limits, cases=cases)
        for one in cases:
            self._stories.setdefault(one.case.name, Story()).attempts += 1
        self._sent[name] = Sent(batch=batch, worker=worker.address, alone=alone, estimated=self._estimated(cases))
        worker.sent.append(name)
        self.batches += 1
        self._cluster.send(name, machine.work, batch, worker=worker.address)

    def _take(self, event: Event) -> None:
        if not event.task:
            if event.lost is not None:
                self.gone = event.lost
                return
            for worker in self._vetting.look(event.value):
                self._lose(worker, "it left the cluster")
            return
        if self._vetting.take(event):
            return
        sent = self._sent.pop(event.task, None)
        if sent is None:
            return  # given up before: what comes late is not taken twice
        worker = self._vetting.workers.get(sent.worker)
        if worker is not None:
            worker.sent.remove(event.task)
        if event.lost is not None:
            if not self._cluster.alive:
                self.gone = "the scheduler has gone"
                return
            self._lost(sent, event.lost)
        elif event.error is not None:
            # A worker on which a batch raises cannot work: a renderer's failure is an answer.
            said = f"{type(event.error).__name__}: {event.error}".splitlines()[0]
            self._refuse(sent, said)
        else:
            self._cluster.forget(event.task)
            found = unpacked(event.value)
            self._answered = time.monotonic()
            self._rate += 0.3 * (event.value.seconds / max(sent.estimated, 1e-6) - self._rate)
            for one in sent.batch.cases:
                record, files = found[one.case.name]
                write(files, self._folder)
                if worker is not None:
                    worker.cases += 1
                self._finish(one, record, sent.worker)

    def _finish(self, one: PlannedCase, record: CaseRecord, worker: str) -> None:
        record["worker"] = worker
        record["attempts"] = self._stories.pop(one.case.name).attempts
        self._record(one, record)

    def _refuse(self, sent: Sent, why: str) -> None:
        """Give a worker no more work, and its batches to others, unsplit: not they are to blame."""
        worker = self._vetting.refuse(sent.worker, why)
        again = [sent, *(self._sent.pop(name) for name in (worker.sent if worker is not None else ()))]
        for one in again:
            self._cluster.forget(one.batch.name)
            self._again.append(one.batch.cases)
            self.resent += 1

    def _lose_the_silent(self) -> None:
        for worker in self._vetting.silent(LIFETIME):
            self._lose(worker, f"it gave no sign of life for {LIFETIME:g} s")

    def _lose(self, worker: Worker, how: str) -> None:
        """Take a worker as lost with all that is on its way to it."""
        names, worker.sent = worker.sent, []
        if names:
            worker.lost += 1
        for name in names:
            sent = self._sent.pop(name)
            self._cluster.forget(name)
            self._lost(sent, how)

    def _lost(self, sent: Sent, how: str) -> None:
        """Send a lost batch again: in two halves, or give its case up."""
        cases = sent.batch.cases
        if len(cases) > 1:
            middle = len(cases) // 2
            self._again.extend((cases[:middle], cases[middle:]))
            self.split += 1
            self.resent += 2
            return
        one = next(iter(cases))
        story = self._stories[one.case.name]
        if sent.alone:
            story.ends.append(f"{sent.worker}: {how}")
        if len(story.ends) < LOSSES:
            self._again.append(cases)
            self.resent += 1
            return
        self._finish(one, self._given_up(one, story), sent.worker)

    def _given_up(self, one: PlannedCase, story: Story) -> CaseRecord:
        """Return the record of a case that lost its workers."""
        why = f"it lost {len(story.ends)} workers, each of which had nothing else to do: {'; '.join(story.ends)}"
        subject = self._terms.subject
        candidates = [
            Answers(
                name=name,
                precision=name.split("/")[0] if subject.is_tracer else "float32",
                error=why,
            )
            for name in one.configurations
        ]
        reply = Reply(value=None, error=why, trace=None, seconds=0.0)
        record = unjudged(one.case, candidates, (), reply, folder=self._folder, subject=subject)
        for render in record["renders"]:
            render["seconds"] = 0.0
        record.update({"judge_seconds": 0.0, "seconds": 0.0, "remembered": False, "versions": {}})
        return record

    def _estimated(self, cases: Iterable[PlannedCase]) -> float:
        references = len(self._terms.demands.references)
        return sum(
            estimate(one.case, candidates=len(one.configurations), references=references).seconds for one in cases
        )

    def _seconds(self, cases: Iterable[PlannedCase]) -> float:
        """Return how long a worker takes for cases, as measured so far."""
        return self._rate * self._estimated(cases)


@contextmanager
def dispatch(place: Place, terms: Terms, limits: Limits, *, tell: Callable[[str], None]) -> Iterator[Dispatch]:
    """Yield what hands out a run's cases at a place, once a worker is there that may have them.

    Raises:
        ClusterError: the cluster cannot be used, or has no worker within `WAIT` seconds that would find the same.

    """
    choose_packaged_llvm()
    with reached(place) as cluster:
        vetting = Vetting(cluster, terms, limits, tell=tell)
        vetting.wait(WAIT)
        found = Dispatch(cluster, terms, limits, vetting, patience=WAIT)
        try:
            yield found
        finally:
            found.close()
