"""The work between plan and results: a few cases at once through the pool, each recorded as it finishes."""

from typing import Any

from rich.console import Console

from reports.cache.store import Store
from reports.publish.pictures import Drawing
from reports.run.case_run import CaseRun
from reports.run.journal import Journal
from reports.run.memory import Memory
from reports.run.plan import PlannedCase, key
from reports.run.pool import Pool
from reports.run.progress import CaseProgress
from reports.run.request import RunRequest
from reports.run.tasks import JUDGE, UNDER_TEST
from reports.subjects import PROGRAM

PATIENCE = 120.0  # s for references and the judge, where --timeout speaks of another program's renders
AHEAD = 3  # cases on their way at once: enough to keep every worker busy, few enough to stay small in memory


def render_and_judge(
    request: RunRequest,
    planned: tuple[PlannedCase, ...],
    references: tuple[str, ...],
    console: Console,
    drawing: Drawing,
    store: Store | None,
) -> tuple[list[dict[str, Any]], bool]:
    """Return the records in the plan's order, and whether the user interrupted."""
    # Judging is the longest part and shares nothing: it may take every processor.
    subject = request.subject
    pool = Pool(
        jobs=request.jobs,
        timeout=request.timeout if subject.is_tracer else max(PATIENCE, request.timeout),
        copies={JUDGE: request.jobs, PROGRAM: request.jobs},
        timeouts=_timeouts(request),
    )
    records: dict[str, dict[str, Any]] = {}
    # What must be answered is part of the question: a verdict of a run that did not require it is not taken up.
    asked = (*references, *(f"required: {name}" for name in sorted(set(request.require))))
    if not subject.is_tracer:
        asked = (*asked, f"under test: {subject.title}", *subject.identity)
    keys = {one.case.name: key(one, asked) for one in planned}
    memory = None
    if store is not None:
        memory = Memory(store, references, subject=subject, require=request.require, full=request.full)
    interrupted = False
    with Journal(request.out, resume=request.resume) as journal, CaseProgress(console, total=len(planned)) as progress:

        def finished(case_run: CaseRun, record: dict[str, Any]) -> None:
            name = case_run.planned.case.name
            records[name] = record
            record["key"] = keys[name]
            drawing.submit(record)
            journal.append(keys[name], record)
            progress.finished(record, again=False)

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
            started, before = 0, len(records)
            while len(records) < len(planned):
                while started - (len(records) - before) < AHEAD and (one := next(pending, None)) is not None:
                    case_run = CaseRun(
                        one,
                        references,
                        pool,
                        folder=request.out,
                        require=request.require,
                        subject=subject,
                        memory=memory,
                        full=request.full,
                        finished=finished,
                    )
                    case_run.start()
                    started += 1
                if memory is not None:
                    memory.prepare()
                pool.step()
        except KeyboardInterrupt:
            interrupted = True
        finally:
            pool.close()
    return [records[one.case.name] for one in planned if one.case.name in records], interrupted


def _timeouts(request: RunRequest) -> dict[str, float]:
    """Return how long [s] the subject may take.

    A program's own limit ends it, with a reason; it may be called twice for a case, and its image is to be read.
    """
    subject = request.subject
    if subject.is_tracer:
        return {}
    return {PROGRAM: 2 * subject.seconds + PATIENCE, f"{UNDER_TEST}{subject.name}": request.timeout}
