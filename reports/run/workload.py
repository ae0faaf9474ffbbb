"""The work between plan and results: a few cases at once through the pool, each recorded as it finishes."""

import re
from array import array
from collections.abc import Sequence
from typing import TYPE_CHECKING

from rich.console import Console

from rayproof.reports.cache.store import Store
from rayproof.reports.called import called
from rayproof.reports.processes.pool import Pool
from rayproof.reports.publish.scene3d.pictures import ALL_OF, Drawing
from rayproof.reports.results.case_table import Cases
from rayproof.reports.results.records import CaseRecord
from rayproof.reports.run.cases_under_way import CasesUnderWay, Terms
from rayproof.reports.run.demands import demands
from rayproof.reports.run.dependencies import Dependencies, Earlier
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


def render_and_judge(
    request: RunRequest,
    planned: Sequence[PlannedCase],
    references: tuple[str, ...],
    console: Console,
    drawing: Drawing,
    store: Store | None,
    workers: "Pool | Dispatch",
    dependencies: Dependencies,
    earlier: Earlier | None,
) -> tuple[Cases, bool, str | None]:
    """Return the records in the plan's order, whether the user interrupted, and in words why the rest was not done.

    `workers` are the processes of this machine, or those of a cluster. Where the first calls of a program under test
    all fail alike, the rest is not made. What `earlier` found of cases on which nothing has changed is taken up.
    """
    subject = request.subject
    done: set[str] = set()
    asked = demands(request, references)
    keys = {one.case.name: record_key(one, asked).digest for one in planned}
    interrupted, gone = False, None
    calls = FirstCalls(len(planned)) if subject.name == PROGRAM else None
    draw = drawing.submit if len(planned) <= ALL_OF else drawing.leave_out
    with (
        Journal(request.out, resume=request.resume or earlier is not None) as journal,
        CaseProgress(console, total=len(planned)) as progress,
    ):

        def finished(one: PlannedCase, record: CaseRecord) -> None:
            name = one.case.name
            done.add(name)
            record["key"] = keys[name]
            record["rendered"] = True
            if dependencies.known:
                record["depends"] = dependencies.of(one)
            record["reproduce"] = reproduce(request.out, one.case, one.configurations, subject)
            draw(record)
            journal.append(keys[name], record)
            progress.finished(record, again=False)
            if calls is not None:
                calls.finished(record)

        def enough() -> bool:
            return calls is not None and calls.hopeless is not None

        try:
            todo = array("Q")
            for number, one in enumerate(planned):
                key = keys[one.case.name]
                known = journal.finished(key) if earlier is None else unchanged(one, earlier, journal, key)
                if known is not None:
                    done.add(one.case.name)
                    again = reproduce(request.out, one.case, one.configurations, subject)
                    if known.get("reproduce") != again:  # a folder that was moved
                        known["reproduce"] = again
                        journal.append(keys[one.case.name], known)
                    draw(known)
                    progress.finished(known, again=True)
                else:
                    todo.append(number)
            if isinstance(workers, Pool):
                terms = Terms(
                    demands=asked,
                    subject=subject,
                    cached=store is not None,
                    patient=request.patient,
                    most=request.case_timeout,
                    artifacts=request.artifacts,
                )
                under_way = CasesUnderWay(terms, workers, folder=request.out, store=store, finished=finished)
                pending = (planned[number] for number in todo)
                while len(done) < len(planned) and not enough():
                    while under_way.has_room and (one := next(pending, None)) is not None:
                        under_way.start(one)
                    progress.working(under_way.doing, workers.busy)
                    under_way.step()
            else:
                workers.put_through(
                    (planned[number] for number in todo),
                    folder=request.out,
                    finished=finished,
                    enough=enough,
                    glance=lambda: progress.working(workers.under_way, workers.busy),
                )
                gone = workers.gone
        except KeyboardInterrupt:
            interrupted = True
        finally:
            workers.close()
        found = journal.cases(key for name, key in keys.items() if name in done)
    if gone is not None:
        return found, interrupted, f"{gone}; {len(found)} of {len(planned)} cases are finished, go on with --resume"
    if calls is not None and calls.hopeless is not None:
        said = f"the first {FIRST} calls fail alike: {calls.hopeless}; `{called()} call` makes one of them by hand"
        return found, interrupted, said
    return found, interrupted, None


def unchanged(planned: PlannedCase, earlier: Earlier, journal: Journal, key: str) -> CaseRecord | None:
    """Return the record of a case on which nothing has changed, now under `key`; None if it must be done."""
    record = earlier.unchanged(planned, journal.finished)
    if record is None:
        return None
    record["rendered"], record["key"] = False, key
    journal.append(key, record)
    return record


class FirstCalls:
    """The first calls of a program: whether they all failed, in the same words."""

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
