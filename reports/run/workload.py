"""The work between plan and results: a few cases at once through the pool, each recorded as it finishes."""

import re
from array import array
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from rich.console import Console

from rayproof.reports.called import called
from rayproof.reports.processes.pool import Pool
from rayproof.reports.results.case_table import Cases
from rayproof.reports.results.records import CaseRecord
from rayproof.reports.run.cache_store import Store
from rayproof.reports.run.cases_under_way import CasesUnderWay, Terms
from rayproof.reports.run.demands import demands
from rayproof.reports.run.journal import Journal
from rayproof.reports.run.plan import PlannedCase, record_key
from rayproof.reports.run.progress import CaseProgress
from rayproof.reports.run.record.reproducing import reproduce
from rayproof.reports.run.request import RunRequest
from rayproof.reports.subjects import PROGRAM

if TYPE_CHECKING:
    from rayproof.reports.run.engine.dispatch import Dispatch

FIRST = 3  # calls of a program; if they fail alike, so will the rest
_CHANGING = re.compile(r"\S*rayproof-\S*|\d+")  # a call's own folder, and numbers such as a process's


@dataclass(frozen=True)
class Recording:
    """How a case is recorded when it is finished, or found finished: its key, journal and progress."""

    request: RunRequest
    keys: Mapping[str, str]  # by the cases' names
    journal: Journal
    progress: CaseProgress
    calls: "FirstCalls"
    done: set[str] = field(default_factory=set)  # names

    def finished(self, one: PlannedCase, record: CaseRecord) -> None:
        """Record a case that was just rendered and judged."""
        key = self.keys[one.case.name]
        self.done.add(one.case.name)
        record["key"] = key
        record["reproduce"] = self._reproduce(one)
        self.journal.append(key, record)
        self.progress.finished(record, again=False)
        self.calls.finished(record)

    def taken_up(self, one: PlannedCase) -> bool:
        """Take up what the journal knows of a case; say whether it does."""
        key = self.keys[one.case.name]
        known = self.journal.finished(key)
        if known is None:
            return False
        self.done.add(one.case.name)
        again = self._reproduce(one)
        if known.get("reproduce") != again:  # a folder that was moved
            known["reproduce"] = again
            self.journal.append(key, known)
        self.progress.finished(known, again=True)
        return True

    def _reproduce(self, one: PlannedCase) -> str:
        return reproduce(self.request.out, one.case, one.configurations, self.request.subject)


def render_and_judge(
    request: RunRequest,
    planned: Sequence[PlannedCase],
    references: tuple[str, ...],
    console: Console,
    store: Store | None,
    workers: "Pool | Dispatch",
) -> tuple[Cases, bool, str | None]:
    """Return the records in the plan's order, whether the user interrupted, and in words why the rest was not done.

    `workers` are the processes of this machine, or those of a cluster. Where the first calls of a program under test
    all fail alike, the rest is not made.
    """
    asked = demands(request, references)
    keys = {one.case.name: record_key(one, asked).digest for one in planned}
    interrupted, gone = False, None
    calls = FirstCalls(len(planned) if request.subject.name == PROGRAM else 0)
    with (
        Journal(request.out, resume=request.resume) as journal,
        CaseProgress(console, total=len(planned)) as progress,
    ):
        recording = Recording(request, keys, journal, progress, calls)
        try:
            todo = array("Q", (number for number, one in enumerate(planned) if not recording.taken_up(one)))
            pending = (planned[number] for number in todo)
            if isinstance(workers, Pool):
                terms = Terms(
                    demands=asked,
                    subject=request.subject,
                    cached=store is not None,
                    patient=request.patient,
                )
                under_way = CasesUnderWay(terms, workers, folder=request.out, store=store, finished=recording.finished)
                while len(recording.done) < len(planned) and calls.hopeless is None:
                    while under_way.has_room and (one := next(pending, None)) is not None:
                        under_way.start(one)
                    progress.working(under_way.doing, workers.busy)
                    under_way.step()
            else:
                workers.put_through(
                    pending,
                    folder=request.out,
                    finished=recording.finished,
                    enough=lambda: calls.hopeless is not None,
                    glance=lambda: progress.working(workers.under_way, workers.busy),
                )
                gone = workers.gone
        except KeyboardInterrupt:
            interrupted = True
        finally:
            workers.close()
        found = journal.cases(key for name, key in keys.items() if name in recording.done)
    if gone is not None:
        return found, interrupted, f"{gone}; {len(found)} of {len(planned)} cases are finished, go on with --resume"
    if calls.hopeless is not None:
        said = f"the first {FIRST} calls fail alike: {calls.hopeless}; `{called()} probe --keep FOLDER` makes one"
        return found, interrupted, said
    return found, interrupted, None


class FirstCalls:
    """The first calls of a program: whether they all failed, in the same words. Any other subject has none."""

    def __init__(self, planned: int) -> None:
        self._asked = planned > FIRST  # of so few cases all are made
        self._said: list[str] = []
        self.hopeless: str | None = None  # what they all ended in

    def finished(self, record: CaseRecord) -> None:
        """Take up what became of another case."""
        if not self._asked:
            return
        error = next(
            (str(one["error"]) for one in record["renders"] if one["renderer"] == PROGRAM and one["error"]), None
        )
        self._said.append("" if error is None else _CHANGING.sub("", error))
        self._asked = error is not None and len(self._said) < FIRST
        if error is not None and len(self._said) == FIRST and len({*self._said}) == 1:
            self.hopeless = error
