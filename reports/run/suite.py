"""A run from request to report: choose cases, render and judge them, write what was found as it is found."""

import json
import platform
import shutil
import sys
import time
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

from rich.console import Console

from cases.case import Case
from cases.families import all_cases, select
from reports.judge.outcomes import Outcome, exit_code
from reports.publish.pictures import Drawing
from reports.run import assemble
from reports.run.case_run import CaseRun
from reports.run.guards import stand_guards
from reports.run.journal import NAME as JOURNAL
from reports.run.journal import Journal, settle
from reports.run.llvm import choose_packaged_llvm
from reports.run.panel import Panel, panel
from reports.run.plan import PlannedCase, key, plan
from reports.run.pool import Pool
from reports.run.progress import CaseProgress, worst_first
from reports.run.request import RunRequest
from reports.run.stopping import terminated_as_interrupted
from reports.run.supported import concerning
from reports.run.tasks import UNDER_TEST
from reports.subjects import PROGRAM, Subject

FAILED, INTERRUPTED = 1, 130
LOG_WIDTH = 140  # columns of a log file: a table is not squeezed into a terminal that is not there
PATIENCE = 120.0  # s for references and the judge, where --timeout speaks of another program's renders
AHEAD = 3  # cases on their way at once: enough to keep every worker busy, few enough to stay small in memory


def run(request: RunRequest) -> int:
    """Run the request; return the exit code: 0 passed, 1 failed, 3 not all could be measured, 130 interrupted.

    Raises:
        LookupError, ValueError, OSError: the request itself is wrong; nothing was run.

    """
    choose_packaged_llvm()
    stand_guards()
    console = Console(highlight=False)
    if not console.is_terminal:
        console = Console(highlight=False, width=LOG_WIDTH)
    subject = request.subject
    names = request.configurations if subject.is_tracer else (subject.name,)
    planned = plan(_cases(request.selectors), names, subject)
    heard = panel(request.require, subject)
    request.out.mkdir(parents=True, exist_ok=True)
    if not request.resume:
        _clear(request.out)
    faults = _faults(planned) if subject.is_tracer else []
    if faults:
        console.print(f"[bold red]PLANTED FAULT in this run: {', '.join(faults)}; it must fail[/]")
    who = "" if subject.is_tracer else f"{subject.title}: "
    line = f"{who}{len(planned)} cases against {', '.join(heard.names)}; results in {request.out}"
    console.print(line, soft_wrap=True, markup=False)
    start, started = time.perf_counter(), datetime.now(UTC)
    with terminated_as_interrupted(), Drawing(request.out) as drawing:
        records, interrupted = _render_and_judge(request, planned, heard.names, console, drawing)
    results = _results(planned, records, heard, faults, started, subject)
    results["finished"] = not interrupted
    results["seconds"] = round(time.perf_counter() - start, 3)
    worse = _remember(request, results, console)
    _publish(request, results, drawing.reason, console)
    if not interrupted:
        settle(request.out)
    for sentence in worse:
        console.print(f"worse than its history: {sentence}", style="yellow", soft_wrap=True, markup=False)
    if interrupted:
        console.print(f"interrupted after {len(records)} of {len(planned)} cases; go on with --resume", style="yellow")
        return INTERRUPTED
    silent = assemble.silent(records, request.require)
    for name in silent:
        console.print(f"{name} is required and answered nothing in this run", style="red", soft_wrap=True)
    code = exit_code(concerning((Outcome(record["verdict"]) for record in records), tracer=subject.is_tracer))
    return max(code, FAILED) if silent else code


def _remember(request: RunRequest, results: dict[str, Any], console: Console) -> list[str]:
    """Keep the run in its history, if it has one, and return what became worse; a failure costs no result."""
    if request.history is None:
        return []
    from reports.history.database import HistoryError
    from reports.history.keeping import keep

    try:
        return keep(request.history, results)
    except HistoryError as error:
        results["environment"]["history"] = f"not kept: {error}"
        console.print(f"the run is not in its history: {error}", style="yellow", soft_wrap=True, markup=False)
        return []


def _cases(selectors: tuple[str, ...]) -> tuple[Case, ...]:
    """Return the selected cases; a selector that ends in .json is a scene file."""
    files = tuple(selector for selector in selectors if selector.endswith(".json"))
    names = tuple(selector for selector in selectors if selector not in files)
    cases = select(names) if selectors else all_cases()
    if files:
        from reports.run.scene_case import cases_of_files

        cases += cases_of_files([Path(file) for file in files])
    return cases


def _clear(folder: Path) -> None:
    """Remove what an earlier run left in its own folder, so that no image outlives the run that made it.

    Only where there is a run's journal: what is not ours is left alone.
    """
    if (folder / JOURNAL).is_file():
        for name in ("images", "scenes", "pictures", "data"):
            shutil.rmtree(folder / name, ignore_errors=True)


def _faults(planned: tuple[PlannedCase, ...]) -> list[str]:
    """Return the planted faults, and the wrong forms printed in the lecture, that any configuration uses."""
    from tracer.configuration import Configuration

    names = {name for one in planned for name in one.configurations}
    used = [Configuration.parse(name) for name in names]
    return sorted({wrong for one in used for wrong in (*one.faults, *one.controls)})


def _render_and_judge(
    request: RunRequest,
    planned: tuple[PlannedCase, ...],
    references: tuple[str, ...],
    console: Console,
    drawing: Drawing,
) -> tuple[list[dict[str, Any]], bool]:
    """Return the records in the plan's order, and whether the user interrupted."""
    # Judging is the longest part and shares nothing: it may take every processor.
    subject = request.subject
    pool = Pool(
        jobs=request.jobs,
        timeout=request.timeout if subject.is_tracer else max(PATIENCE, request.timeout),
        copies={"judge": request.jobs, PROGRAM: request.jobs},
        timeouts=_timeouts(request),
    )
    records: dict[str, dict[str, Any]] = {}
    # What must be answered is part of the question: a verdict of a run that did not require it is not taken up.
    asked = (*references, *(f"required: {name}" for name in sorted(set(request.require))))
    if not subject.is_tracer:
        asked = (*asked, f"under test: {subject.title}", *subject.identity)
    keys = {one.case.name: key(one, asked) for one in planned}
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
                        cached=request.cached,
                        full=request.full,
                        finished=finished,
                    )
                    case_run.start()
                    started += 1
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


def _results(
    planned: tuple[PlannedCase, ...],
    records: list[dict[str, Any]],
    heard: Panel,
    faults: list[str],
    started: datetime,
    subject: Subject,
) -> dict[str, Any]:
    """Return results.json's content, as docs/results.md describes it."""
    from reference import REFERENCES

    versions: dict[str, str] = {}
    for record in records:
        versions |= record.get("versions", {})
    environment = {"python": sys.version.split()[0], "machine": platform.machine(), "system": platform.platform()}
    detail = assemble.coverage(records)
    return {
        "schema": 1,
        "rayproof": version("rayproof"),
        "command": " ".join(["rayproof", *sys.argv[1:]]),
        "started": started.isoformat(timespec="seconds"),
        "verdict": assemble.verdict(records, planned=len(planned), tracer=subject.is_tracer).value,
        "subject": subject.title,
        "faults": faults,
        "environment": environment | {name: text for name, text in versions.items() if name not in heard.names},
        "configurations": sorted({name for one in planned for name in one.configurations}),
        "references": {
            name: {
                "version": versions.get(name, "not asked"),
                "precision": REFERENCES[name].precision,
                "independent": bool(REFERENCES.about(name).get("independent", False)),
            }
            for name in heard.names
        },
        "absent": heard.absent,
        "summary": assemble.case_ledger(records, planned=len(planned)),
        "checks": assemble.check_ledger(records),
        "coverage": {item: entry["cases"] for item, entry in detail.items()},
        "coverage_detail": detail,
        "review": assemble.review(records),
        "findings": assemble.findings(records),
        "cases": records,
    }


def _publish(request: RunRequest, results: dict[str, Any], why: str | None, console: Console) -> None:
    """Write results.json and every published form; print the worst cases and where the report is.

    `why` says why pictures were left out.
    """
    from reports.publish import publish_all
    from reports.publish.results import save_results

    results["environment"]["pictures"] = why or "drawn"
    save_results(request.out, results)
    publish_all(request.out)
    if request.json is not None:
        request.json.write_text(json.dumps(results), encoding="utf-8")
    console.print(worst_first(results["cases"]))
    if why:
        console.print(f"no 3-D pictures: {why}", soft_wrap=True)
    counts = ", ".join(f"{number} {name}" for name, number in results["summary"].items() if number)
    console.print(f"cases: {counts}", soft_wrap=True)
    counts = ", ".join(f"{number} {name}" for name, number in results["checks"].items() if number)
    console.print(f"checks: {counts}", soft_wrap=True)
    console.print(f"{results['verdict']}: {request.out / 'index.html'}", soft_wrap=True)
