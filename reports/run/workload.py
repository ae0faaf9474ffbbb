"""The work between plan and results: a few cases at once through the pool, each recorded as it finishes."""

import re
from collections.abc import Collection
from functools import partial
from typing import cast

from rich.console import Console

from rayproof.cases.case import Case
from rayproof.reports.cache.store import Store
from rayproof.reports.processes.pool import Pool
from rayproof.reports.publish.scene3d.pictures import Drawing
from rayproof.reports.results.records import CaseRecord
from rayproof.reports.run.banded_run import BandedRun, Finished, Merging
from rayproof.reports.run.case_run import CaseRun
from rayproof.reports.run.demands import demands
from rayproof.reports.run.journal import Journal
from rayproof.reports.run.plan import PlannedCase, record_key
from rayproof.reports.run.progress import CaseProgress
from rayproof.reports.run.record.merging import merged
from rayproof.reports.run.request import RunRequest
from rayproof.reports.run.size import bands_of, deadline
from rayproof.reports.run.verdict_memory import Memory
from rayproof.reports.subjects import PROGRAM

# Cases on their way at once: so many that a stretch of cases that take the one under test long leaves enough to ask and
# to judge for the other processors, so few pixels that what they were answered, up to 2 KB each, is small in memory.
AT_LEAST = 3
FIRST = 3  # calls of a program; if they fail alike, so will the rest
_CHANGING = re.compile(r"\S*rayproof-\S*|\d+")  # a call's own folder, and numbers such as a process's
PIXELS = 2**17


def render_and_judge(
    request: RunRequest,
    planned: tuple[PlannedCase, ...],
    references: tuple[str, ...],
    console: Console,
    drawing: Drawing,
    store: Store | None,
    pool: Pool,
) -> tuple[list[CaseRecord], bool, str | None]:
    """Return the records in the plan's order, whether the user interrupted, and why a program cannot be called.

    Where the first calls of a program under test all fail alike, the rest is not made.
    """
    subject = request.subject
    records: dict[str, CaseRecord] = {}
    asked = demands(request, references)
    keys = {one.case.name: record_key(one, asked).digest for one in planned}
    memory = None if store is None else Memory(store, asked)
    interrupted, calls = False, FirstCalls(len(planned)) if subject.name == PROGRAM else None
    under_way: dict[str, int] = {}  # name -> pixels
    with Journal(request.out, resume=request.resume) as journal, CaseProgress(console, total=len(planned)) as progress:
        in_bands: dict[str, BandedRun] = {}

        def finished(case_run: CaseRun | BandedRun, record: CaseRecord) -> None:
            name = case_run.planned.case.name
            records[name] = record
            del under_way[name]
            record["key"] = keys[name]
            drawing.submit(record)
            journal.append(keys[name], record)
            progress.finished(record, again=False)
            if calls is not None:
                calls.finished(record)

        def start(one: PlannedCase) -> None:
            seconds = _patience(request, one, references)

            def run(planned: PlannedCase, finished: Finished) -> CaseRun:
                return CaseRun(
                    planned,
                    references,
                    pool,
                    folder=request.out,
                    require=request.require,
                    subject=subject,
                    memory=memory,
                    own=asked.own,
                    full=request.full,
                    certified=request.certified,
                    seconds=seconds,
                    finished=finished,
                )

            whole = request.certified or one.trials
            bands = () if whole else bands_of(one.case, subject)
            if not bands:
                run(one, finished).start()
                return
            together = cast("Merging", partial(merged, folder=request.out, subject=subject))
            banded = BandedRun(one, bands, run=run, merged=together, finished=finished)
            in_bands[one.case.name] = banded
            banded.start()

        try:
            todo = []
            for one in planned:
                known = journal.finished(keys[one.case.name])
                if known is not None:
                    records[one.case.name] = known
                    drawing.submit(known)
                    progress.finished(known, again=True)
                else:
                    todo.append(one)
            pending = iter(todo)
            while len(records) < len(planned) and (calls is None or calls.hopeless is None):
                while has_room(under_way.values()) and (one := next(pending, None)) is not None:
                    under_way[one.case.name] = _pixels(one.case)
                    start(one)
                pool.start()
                if memory is not None:
                    memory.prepare()
                doing = [f"{name}, {in_bands[name].about}" if name in in_bands else name for name in under_way]
                progress.working(doing, pool.busy)
                pool.step()
        except KeyboardInterrupt:
            interrupted = True
        finally:
            pool.close()
    found = [records[one.case.name] for one in planned if one.case.name in records]
    return found, interrupted, None if calls is None else calls.hopeless


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


def _patience(request: RunRequest, planned: PlannedCase, references: tuple[str, ...]) -> float | None:
    """Return how long each task of a case may take, or None where the user said."""
    if not request.patient:
        return None
    about = {"candidates": len(planned.configurations), "references": len(references)}
    return deadline(planned.case, **about, subject=request.subject)


def has_room(pixels: Collection[int]) -> bool:
    """Say whether another case may start beside those under way, which have so many pixels each."""
    return len(pixels) < AT_LEAST or sum(pixels) < PIXELS


def _pixels(case: Case) -> int:
    """Return how many pixels a case's largest image has, samples included."""
    return case.scene.camera.width * case.scene.camera.height * case.samples**2
