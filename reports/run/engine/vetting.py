"""Which workers a cluster has, and which of them may have work: those that would find what this machine finds.

Each is asked what it is before its first batch: its code, packages, references and processor. One that differs gets no
work, and the first difference is told.
"""

import time
import uuid
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field

from rayproof.reports.results.records import RefusedRecord, WorkerRecord
from rayproof.reports.run.case import Terms
from rayproof.reports.run.engine import machine
from rayproof.reports.run.engine.batch import Limits
from rayproof.reports.run.engine.cluster import Cluster, ClusterError, Event, WorkerState
from rayproof.reports.run.engine.facts import Facts, facts
from rayproof.reports.run.engine.waiting import Structure

GLANCE = 1.0  # s, the longest wait at a time
HEARING = 2 * GLANCE  # s between two glances that count: a wait, and taking up what came
LIFETIME = 60.0  # s without a sign of life after which a worker is lost
SILENCE = 60.0  # s that a worker has to tell what it is, its references' versions included


@dataclass(kw_only=True)
class Worker:
    """A worker that found its way to the run."""

    address: str
    state: WorkerState
    processor: str = ""
    jobs: int = 0
    told: bool = False  # what it is, so that it may get work
    asked: float = 0.0  # s that it has had to tell
    silence: float = 0.0  # s since it last gave a sign of life
    sent: list[str] = field(default_factory=list)  # names of batches on their way
    structure: Structure | None = None  # of the cases that it got last
    cases: int = 0
    lost: int = 0

    def record(self) -> WorkerRecord:
        """Return it as results name it."""
        return {
            "id": self.address, "processor": self.processor, "jobs": self.jobs, "cases": self.cases, "lost": self.lost
        }  # fmt: skip


class Vetting:
    """Which workers there are, and which of them may have work: those that would find what this machine finds."""

    def __init__(self, cluster: Cluster, terms: Terms, limits: Limits, *, tell: Callable[[str], None]) -> None:
        self._cluster, self._terms, self._limits, self._tell = cluster, terms, limits, tell
        self._ours: Facts = facts(terms)
        self._asked: dict[str, str] = {}  # name of the question -> worker
        self._away: set[str] = set()  # refused or lost: an address that comes back is another worker
        self._run = uuid.uuid4().hex[:12]
        self._glanced = time.monotonic()
        self.workers: dict[str, Worker] = {}
        self.ever: list[Worker] = []
        self.refused: list[RefusedRecord] = []

    @property
    def count(self) -> int:
        """Return how many workers may have work."""
        return max(1, sum(one.told for one in self.workers.values()))

    def wait(self, seconds: float) -> None:
        """Wait until a worker may have work.

        Raises:
            ClusterError: none came in so many seconds, or each that came differs.

        """
        until = time.monotonic() + seconds
        while not any(one.told for one in self.workers.values()):
            event = self._cluster.next(GLANCE)
            if event is not None and not event.task:
                if event.lost is not None:
                    raise ClusterError(f"--scheduler: {event.lost}")
                self.look(event.value)
            elif event is not None:
                self.take(event)
            self.silent(LIFETIME)
            if self.refused and not self.workers:
                first = self.refused[0]
                more = f", and {len(self.refused) - 1} more like it" if len(self.refused) > 1 else ""
                raise ClusterError(f"--scheduler: no worker may have work: {first['id']}: {first['why']}{more}")
            if time.monotonic() > until:
                raise ClusterError(f"--scheduler: no worker came within {seconds:g} s")

    def look(self, there: Mapping[str, WorkerState]) -> list[Worker]:
        """Take up which workers there are, ask new ones what they are, and return those that have gone."""
        for address, state in there.items():
            worker = self.workers.get(address)
            if worker is None and address not in self._away:
                self.workers[address] = Worker(address=address, state=state)
                question = f"rayproof-{self._run}-facts-{address}"
                self._asked[question] = address
                self._cluster.send(question, machine.tell, self._terms, worker=address)
            elif worker is not None and state.last_seen != worker.state.last_seen:
                worker.state, worker.silence = state, 0.0
        gone = [self.workers.pop(address) for address in list(self.workers) if address not in there]
        self._forget(gone)
        return gone

    def take(self, event: Event) -> bool:
        """Take up what a worker says of itself; say whether it was that."""
        address = self._asked.pop(event.task, None)
        if address is None:
            return False
        self._cluster.forget(event.task)
        worker = self.workers.get(address)
        if worker is None:
            return True
        if event.error is not None or event.lost is not None:
            why = event.lost if event.error is None else f"{type(event.error).__name__}: {event.error}"
            self.refuse(address, str(why))
            return True
        theirs, processors = event.value
        difference = self._ours.difference(theirs)
        if difference is not None:
            self.refuse(address, difference)
            return True
        worker.told, worker.processor, worker.jobs = True, theirs.model, self._limits.jobs or processors
        self.ever.append(worker)
        return True

    def refuse(self, address: str, why: str) -> Worker | None:
        """Give a worker no more work."""
        why = " ".join(why.split())
        self.refused.append({"id": address, "why": why})
        self._tell(f"worker {address} gets no work: {why}")
        self._away.add(address)
        worker = self.workers.pop(address, None)
        self._forget([worker] if worker is not None else [])
        return worker

    def silent(self, seconds: float) -> list[Worker]:
        """Return the workers that gave no sign of life for so long, which have no work from now on.

        It is called at least once a glance. A longer time between two calls is not the workers' silence: this process
        was stopped, by Ctrl-Z for instance, and could hear nobody.
        """
        now = time.monotonic()
        passed, self._glanced = min(now - self._glanced, HEARING), now
        for one in self.workers.values():
            one.silence += passed
            one.asked += passed
        for one in [one for one in self.workers.values() if not one.told and one.asked > SILENCE]:
            self.refuse(one.address, f"it did not say within {SILENCE:g} s what it is")
        silent = [one for one in self.workers.values() if one.silence > seconds]
        for one in silent:
            self._away.add(one.address)
            del self.workers[one.address]
        self._forget(silent)
        return silent

    def _forget(self, gone: Iterable[Worker]) -> None:
        addresses = {one.address for one in gone}
        for question in [question for question, address in self._asked.items() if address in addresses]:
            del self._asked[question]
            self._cluster.forget(question)
