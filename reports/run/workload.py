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

AHEAD = 3  # cases on their way at once: enough to keep every worker busy, few enough to stay small in memory


def render_and_judge(
    request: RunRequest,
    planned: tuple[PlannedCase, ...],
    references: tuple[str, ...],
    console: Console,
    drawing: Drawing,
    store: Store | None,
    pool: Pool,
) -> tuple[list[dict[str, Any]], bool]:
    """Return the records in the plan's order, and whether the user interrupted."""
    subject = request.subject
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
                pool.start()
                if memory is not None:
                    memory.prepare()
                pool.step()
        except KeyboardInterrupt:
            interrupted = True
        finally:
            pool.close()
    return [records[one.case.name] for one in planned if one.case.name in records], interrupted
