"""`run`: a whole run from request to report: plan, execute, summarise, publish."""

import json
import shlex
import shutil
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import partial
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, cast

from rich.console import Console

from rayproof.cases.case import Case
from rayproof.cases.families import all_cases, select
from rayproof.reports.interchange.framing import DARK
from rayproof.reports.processes.pool import Pool
from rayproof.reports.publish.scene3d.stills import draw_stills, drawn_usually, remove_stale
from rayproof.reports.results.case_records import CaseRecord
from rayproof.reports.results.case_table import NAME as JOURNAL
from rayproof.reports.results.case_table import CaseTable, DamagedTableError, amend, amending, briefs, named
from rayproof.reports.results.document import save_early, save_results, write_results
from rayproof.reports.results.files import legible, remove_drafts, several
from rayproof.reports.results.headline import (
    LEAST_COVERAGE,
    causes,
    examined_line,
    few_answers,
    last_line,
    left_out_in_words,
    no_say,
    of_the_whole,
    worse_by_cause,
)
from rayproof.reports.results.headline import worst_first as worst_cases_first
from rayproof.reports.results.images import keeps_images
from rayproof.reports.results.outcomes import Outcome, concerning, exit_code
from rayproof.reports.results.records import SHUTTING, RunRecord, ShardRecord
from rayproof.reports.run import totals
from rayproof.reports.run.cache_store import Store, usual_store
from rayproof.reports.run.case_pipeline import Engine, LocalCases
from rayproof.reports.run.options import RunOptions, case_options
from rayproof.reports.run.plan import (
    Panel,
    PlannedCase,
    PlannedScenes,
    configurations_of,
    panel,
    plan,
    with_some_twice,
)
from rayproof.reports.run.progress import worst_first
from rayproof.reports.run.scenes import place_of
from rayproof.reports.run.totals import results_document
from rayproof.reports.run.verdict_memory import passed
from rayproof.reports.run.worker_tasks import JUDGE, check_judge
from rayproof.reports.run.workers import RELIEF
from rayproof.reports.run.workers import workers as pool_of
from rayproof.reports.run.workload import Execution, execute
from rayproof.reports.terminal import console as terminal
from rayproof.tracer.kernel.compiler import choose_packaged_llvm

if TYPE_CHECKING:
    from rayproof.reports.run.engine.dispatch import Dispatch

FAILED, NOT_MEASURED, INTERRUPTED = 1, 3, 130
LOADING = 30.0  # s for a process that draws to load its modules, on a busy machine
MOST_OF_A_GATE = 10  # lines per kind in the terminal
EXAMINED = 500  # cases that failed, and as many that passed, to search for the causes of a long run
MOST_LOOKED_AT = 10_000  # of the best cases, to find cases with stored images
SMALL = "small"  # the folder, in a run's folder, for the scenes of `rayproof shrink`
LOG_WIDTH = 140  # columns of a log file, which has no terminal's width


@dataclass(frozen=True, kw_only=True)
class RunPlan:
    """The cases of a run, and the references that judge them."""

    request: RunOptions
    cases: Sequence[PlannedCase]  # for a shard, its part of the whole
    whole: Sequence[PlannedCase]
    panel: Panel
    shard: ShardRecord | None
    faults: list[str]  # planted faults that a configuration uses


def run(request: RunOptions, workers: "Pool | Dispatch | None" = None) -> int:
    """Run the request; return the exit code: 0 passed, 1 failed, 3 not all could be measured, 130 interrupted.

    `workers`: a pool with the tracer's worker, if it was started early, or a cluster.

    Raises:
        LookupError, ValueError, OSError: the request itself is wrong; nothing was run.

    """
    choose_packaged_llvm()
    console = terminal(width=LOG_WIDTH)
    request, store = with_cache(request, console)
    if isinstance(workers, Pool) and not (store is not None and passed("judge", store)):
        # The judge's self-tests take seconds, and there is little other work until the first cases are rendered.
        workers.prepare(JUDGE, partial(check_judge, cached=request.cached))
        workers.start()
    planned = plan_run(request)
    begin(planned, console)
    start, started = time.perf_counter(), datetime.now(UTC)
    engine = engine_of(planned, workers, store)
    execution = execute(request, planned.cases, planned.panel.names, console, engine)
    results, run_totals = summarise(planned, execution, engine, started)
    publish(request, results, execution, start, console)
    return end(planned, execution, results, run_totals, store, console)


def with_cache(request: RunOptions, console: Console) -> tuple[RunOptions, Store | None]:
    """Return the request and its run's cache; if the cache cannot be used, a request without cache and None."""
    if not request.cached:
        return request, None
    store = usual_store()
    unused = store.unused
    store.begin()
    if unused is None:
        return request, store
    console.print(f"nothing is taken from the cache or kept: {unused}", soft_wrap=True)
    return replace(request, cached=False), None


def plan_run(request: RunOptions) -> RunPlan:
    """Return the plan of a request: its cases, or its shard's part of them, and the panel.

    Raises:
        LookupError, ValueError, OSError: the request itself is wrong.

    """
    whole = cases = planned_cases(request)
    chosen_panel = panel(request.require, request.subject)
    shard = None
    if request.shard is not None:
        from rayproof.reports.run.shards import part, told

        shard = told(request, whole, chosen_panel.names)
        cases = part(whole, request.shard)
    faults = _faults(cases) if request.subject.is_tracer else []
    return RunPlan(request=request, cases=cases, whole=whole, panel=chosen_panel, shard=shard, faults=faults)


def begin(planned: RunPlan, console: Console) -> None:
    """Create the results folder, remove an earlier run's files from it, and print the plan."""
    request, subject = planned.request, planned.request.subject
    request.out.mkdir(parents=True, exist_ok=True)
    if not request.resume:
        if (sentence := replaced(request.out)) is not None:
            console.print(sentence, soft_wrap=True, markup=False)
        clear(request.out)
    remove_drafts(request.out)
    if planned.faults:
        console.print(f"PLANTED FAULT in this run: {', '.join(planned.faults)}; it must fail", style="bold red")
    who = "" if subject.is_tracer else f"{subject.capabilities.title if subject.capabilities.name else subject.title}: "
    cases, references = several(len(planned.cases), "case"), ", ".join(planned.panel.names)
    console.print(legible(f"{who}{cases} against {references}; results in {request.out}"), soft_wrap=True)


def engine_of(planned: RunPlan, workers: "Pool | Dispatch | None", store: Store | None) -> Engine:
    """Return the cluster, or the workers of this machine, whose pool is made if it was not started early."""
    request = planned.request
    pool = workers or pool_of(request.subject, jobs=request.jobs, timeout=request.timeout)
    if not isinstance(pool, Pool):
        return pool
    pool.relief, pool.memory = RELIEF, request.worker_memory
    return LocalCases(case_options(request, planned.panel.names), pool, folder=request.out, store=store)


def summarise(
    planned: RunPlan, execution: Execution, engine: Engine, started: datetime
) -> tuple[RunRecord, totals.Totals]:
    """Return the results of a run, and their totals, before the search for causes."""
    records = execution.records
    run_totals = totals.of(records)
    subject = planned.request.subject
    results = results_document(planned.cases, records, run_totals, planned.panel, planned.faults, started, subject)
    results["finished"] = not execution.interrupted and execution.stopped is None
    if (about := engine.record()) is not None:
        results["engine"] = about
    if planned.shard is not None:
        records.table.put_places((planned_case.case.name, place) for place, planned_case in enumerate(planned.whole))
        results["shard"] = planned.shard
        results["configurations"] = planned.shard["configurations"]
    return results, run_totals


def publish(request: RunOptions, results: RunRecord, execution: Execution, start: float, console: Console) -> None:
    """Draw the scenes, search for causes, and write every published form; `start`: the run's start (`perf_counter`)."""
    save_early(request.out, results)  # before the wait for pictures
    records = execution.records
    with console.status("drawing"):
        _, why = draw_stills(request.out, records, drawn_usually(records), seconds=max(LOADING, request.timeout))
    remove_stale(request.out, records)
    find_out(request, results, console, tracer=request.subject.is_tracer, whole=not execution.interrupted)
    results["seconds"] = round(time.perf_counter() - start, 3)
    conclude(request, results, why, console)


def end(
    planned: RunPlan,
    execution: Execution,
    results: RunRecord,
    run_totals: totals.Totals,
    store: Store | None,
    console: Console,
) -> int:
    """Print the warnings that accompany the verdict, and return the exit code."""
    request = planned.request
    if run_totals.dark:
        more = f" (and of {len(run_totals.dark) - 1} others)" if len(run_totals.dark) > 1 else ""
        console.print(legible(f"{run_totals.dark[0]}{more}: {DARK}"), style="yellow", soft_wrap=True, markup=False)
    if store is not None and (left_out := store.left_out):
        full = f"the cache is full, at {store.limit / 2**30:.3g} GiB: {left_out / 2**30:.3g} GiB found no room"
        console.print(f"{full}; RAYPROOF_CACHE_LIMIT gives it more", soft_wrap=True)
    if execution.stopped is not None:
        console.print(legible(f"stopped: {execution.stopped}"), style="bold red", soft_wrap=True, markup=False)
        return NOT_MEASURED
    if execution.interrupted:
        done = f"interrupted after {len(execution.records)} of {len(planned.cases)} cases"
        console.print(f"{done}; go on with --resume", style="yellow")
        return INTERRUPTED
    return code_of(request, results, run_totals, console, tracer=request.subject.is_tracer)


def find_out(request: RunOptions, results: RunRecord, console: Console, *, tracer: bool, whole: bool) -> None:
    """Add the items that may be to blame to the records of a run, and the causes to a `whole` run."""
    _blame(results, tracer=tracer)
    if request.diagnose and whole and results["summary"][Outcome.FAIL.value]:
        save_early(request.out, results)  # before the wait for causes
        _diagnose(request, results, console)


def conclude(request: RunOptions, results: RunRecord, why: str | None, console: Console) -> None:
    """Compare a run with its gate, add it to its history, publish it; `why`: the reason for missing pictures."""
    demanded = request.demanded
    results["least_coverage"] = least_coverage(request)
    if demanded is not None:
        from rayproof.reports.history.gating import held

        # Before the run is added to its history, since the gate may compare it with that history.
        results["gate"] = held(results, demanded).record()
    worse = _remember(request, results, console)
    # For a part of a run this is done later, when all parts are merged and all images were searched for causes.
    if results["finished"] and "shard" not in results and not request.images.full:
        from rayproof.reports.publish.page.previews import leave_previews

        count = leave_previews(request.out, results)
        kept = results["images_kept"]
        results["images_kept"] = {**kept, "cases": kept["cases"] - count, "previews": count}
    _publish(request, results, why, console)
    for sentence in worse:
        console.print(legible(f"worse than its history: {sentence}"), style="yellow", soft_wrap=True, markup=False)


def code_of(
    request: RunOptions, results: RunRecord, run_totals: totals.Totals, console: Console, *, tracer: bool
) -> int:
    """Return the exit code of a run that was neither stopped nor interrupted."""
    demanded = request.demanded
    missing = results["summary"]["planned"] - run_totals.cases.total()
    code = exit_code([*concerning(run_totals.cases.elements(), tracer=tracer), *[Outcome.MISSING] * (missing > 0)])
    if demanded is not None:
        if demanded.lets_through:
            code = FAILED if results["gate"]["red"] else 0
            return NOT_MEASURED if code == 0 and few_answers(results) else code
        code = max(code, FAILED) if results["gate"]["red"] else code
    code = max(code, FAILED) if of_the_whole(results) else code
    return NOT_MEASURED if code == 0 and few_answers(results) else code


def least_coverage(request: RunOptions) -> float:
    """Return the share [%] of the cases that must be answered; a file of known failures has its own demands."""
    lenient = request.demanded is not None and request.demanded.lets_through
    return (0.0 if lenient else LEAST_COVERAGE) if request.least_coverage is None else request.least_coverage


def _remember(request: RunOptions, results: RunRecord, console: Console) -> list[str]:
    """Add the run to its history, if it has one; return sentences about worse results. An error is only noted."""
    if request.history is None:
        return []
    from rayproof.reports.history.database import HistoryError, keep

    try:
        keep(request.history, results)
        return worse_by_cause(results)
    except HistoryError as error:
        results["environment"]["history"] = f"not kept: {error}"
        console.print(f"the run is not in its history: {error}", style="yellow", soft_wrap=True)
        return []


def _blame(results: RunRecord, *, tracer: bool) -> None:
    """Add to each failing case's record the items that its stages leave to blame."""
    if not results["summary"][Outcome.FAIL.value]:
        return
    from rayproof.reports.diagnosis.blaming import by_stages, put

    with amending(results["cases"]):
        for brief in briefs(results["cases"]):
            if brief["verdict"] == Outcome.FAIL and (case := named(results["cases"], brief["name"])) is not None:
                blamed = by_stages(case, ran=tracer)
                if blamed is not None:
                    put(case, blamed)
                    _keep(results, case)


def _keep(results: RunRecord, case: CaseRecord) -> None:
    """Store the blamed items and the causes of a failing case."""
    findings = {key: case[key] for key in ("blamed_items", "excluded", "item", "cause") if key in case}
    amend(results["cases"], case, **findings)


def _diagnose(request: RunOptions, results: RunRecord, console: Console) -> None:
    """Add the causes of the failures to the results, and to the reasons of the cases that they explain.

    An error in the search is only noted.
    """
    from rayproof.reports.diagnosis.diagnosing import diagnose

    searched = examined_for_causes(results["cases"])
    try:
        whole = cast(RunRecord, {**results, "cases": searched})
        causes = diagnose(request.out, whole, accepted=_accepted(request, results))
    except (ArithmeticError, LookupError, RuntimeError, TypeError, ValueError) as error:
        results["environment"]["diagnosis"] = f"not made: {type(error).__name__}: {error}"
        console.print(f"no cause was looked for: {error}", style="yellow", soft_wrap=True)
        return
    results["diagnosis"] = causes
    for record in searched:
        named_in = [str(cause["mistake"]) for cause in causes if record["name"] in cause["cases"]]
        if named_in:
            record["cause"] = [*record.get("cause", []), *named_in]
        if "blamed_items" in record:
            _keep(results, record)


def _accepted(request: RunOptions, results: RunRecord) -> frozenset[str]:
    """Return the failing cases that the gate lets through: their causes are known, and hide no new one."""
    if request.demanded is None or not request.demanded.lets_through:
        return frozenset()
    from rayproof.reports.history.gating import held

    return frozenset(held(results, request.demanded).cases)


def examined_for_causes(cases: Sequence[CaseRecord]) -> list[CaseRecord]:
    """Return the cases that are searched for causes: all, or for a long run the worst and as many of the best.

    Cases that passed and whose images were not kept are left out.
    """

    def tells(case: CaseRecord) -> bool:
        return case["verdict"] != Outcome.PASS or keeps_images(case)

    if len(cases) <= 2 * EXAMINED:
        return [*filter(tells, cases)]
    ordered = worst_cases_first(cases)
    looked_at = range(len(ordered) - 1, max(EXAMINED, len(ordered) - MOST_LOOKED_AT) - 1, -1)
    best = islice((case for place in looked_at if tells(case := ordered[place])), EXAMINED)
    return [*filter(tells, ordered[:EXAMINED]), *reversed([*best])]


def planned_cases(request: RunOptions) -> Sequence[PlannedCase]:
    """Return the cases of a request, each with its configurations; a stream's scenes are read when they are needed.

    Raises:
        LookupError, ValueError, OSError: the request itself is wrong.

    """
    subject = request.subject
    names = request.configurations if subject.is_tracer else (subject.name,)

    if request.scenes is not None:

        def planned(case: Case) -> PlannedCase:
            return plan((case,), names, subject)[0]

        return with_some_twice(PlannedScenes(request.scenes, planned), subject)
    return with_some_twice(plan(cases_of(request.selectors), names, subject), subject)


def cases_of(selectors: tuple[str, ...]) -> tuple[Case, ...]:
    """Return the selected cases; a selector that ends in .json is a scene file."""
    files = tuple(selector for selector in selectors if selector.endswith(".json"))
    names = tuple(selector for selector in selectors if selector not in files)
    cases = select(names) if selectors else all_cases()
    if files:
        from rayproof.reports.run.scenes import cases_of_files, scene_path

        cases += cases_of_files([*map(scene_path, files)])
    return cases


def replaced(folder: Path) -> str | None:
    """Return a sentence about the run in a folder that is about to be replaced, or None if there is none."""
    if not (folder / JOURNAL).is_file():
        return None
    try:
        document = json.loads(CaseTable(folder / JOURNAL).document() or "{}")
        cases, subject = document["summary"]["planned"], document["subject"]
        return legible(f"replaces the run of {document['started']} in {folder}: {subject}, {several(cases, 'case')}")
    except (DamagedTableError, OSError, LookupError, TypeError, ValueError):
        return legible(f"replaces a run in {folder} that did not end, or cannot be read")


def clear(folder: Path) -> None:
    """Remove an earlier run's files from its folder, so that no image outlives the run that made it.

    Stills record their source, and outdated stills are removed when others are drawn. Nothing is removed from a folder
    without a run's journal, since its files may be the user's.
    """
    if (folder / JOURNAL).is_file():
        for name in ("images", "scenes", "data", "previews"):
            shutil.rmtree(folder / name, ignore_errors=True)


def _faults(planned: Sequence[PlannedCase]) -> list[str]:
    """Return the planted faults, and the wrong forms printed in the lecture, that any configuration uses."""
    from rayproof.tracer.configuration import Configuration

    used = [Configuration.parse(name) for name in configurations_of(planned)]
    return sorted({wrong for configuration in used for wrong in (*configuration.faults, *configuration.controls)})


def _shrinking(request: RunOptions, results: RunRecord) -> str | None:
    """Return the command that shrinks the worst failing case, with the output folder that its page reads."""
    if not results["summary"][Outcome.FAIL.value]:
        return None
    worst = next((case for case in worst_cases_first(results["cases"]) if case["verdict"] == Outcome.FAIL), None)
    case = None if worst is None else named(results["cases"], worst["name"])
    failed = [check for check in case.get("checks", []) if check.outcome == Outcome.FAIL] if case else []
    if case is None or not failed or not case.get("reproduce"):
        return None
    program, _, name = shlex.split(str(case["reproduce"]))[:3]
    subject = request.subject
    who = ["--configuration", failed[0].configuration] if subject.is_tracer else subject.options
    return shlex.join([program, "shrink", name, *who, "--out", str(request.out / SMALL / place_of(case["name"]))])


def _publish(request: RunOptions, results: RunRecord, why: str | None, console: Console) -> None:
    """Write results.json and every published form; print the worst cases and the path of the report.

    `why`: the reason for missing pictures.
    """
    from rayproof.reports.publish import publish_all

    results["environment"]["pictures"] = why or "drawn"
    save_results(request.out, results)
    publish_all(request.out, results)
    if request.json is not None:
        write_results(request.json, results)
    console.print(worst_first(results["cases"]))
    if why:
        console.print(f"stills of scenes are missing: {why}", soft_wrap=True)
    counts = ", ".join(f"{number} {name}" for name, number in results["summary"].items() if number)
    console.print(f"cases: {counts}", soft_wrap=True)
    counts = ", ".join(f"{number} {name}" for name, number in results["checks"].items() if number)
    console.print(f"checks: {counts}", soft_wrap=True)
    examined = examined_line(results)
    if examined is not None:
        console.print(examined, soft_wrap=True)
    for sentence in no_say(results):
        console.print(sentence, style="yellow", soft_wrap=True, markup=False)
    for sentence in causes(results):
        console.print(sentence, style="bold red", soft_wrap=True, markup=False)
    if (command := _shrinking(request, results)) is not None:
        console.print(
            legible(f"the smallest scene that fails like the worst case: {command}"), soft_wrap=True, markup=False
        )
    for sentence in of_the_whole(results):
        console.print(f"the run fails: {sentence}", style="bold red", soft_wrap=True, markup=False)
    if left_out := results["images_kept"]["left_out"]:
        console.print(f"images of {several(left_out, 'passing case')} are not kept; see --keep-images", soft_wrap=True)
    if previews := results["images_kept"].get("previews"):
        summary = f"of {several(previews, 'case')} that did not pass only previews are kept"
        console.print(f"{summary}; --keep-images all keeps all images", soft_wrap=True)
    before = sum(bool(case.get("remembered")) for case in briefs(results["cases"]))
    if before:
        console.print(f"verdicts reused, since the images are bit-identical to earlier ones: {before}", soft_wrap=True)
    if "gate" in results:
        summary = results["gate"]
        for key in SHUTTING:
            for sentence in summary[key][:MOST_OF_A_GATE]:
                console.print(legible(f"{key}: {sentence}"), style="bold red", soft_wrap=True, markup=False)
            if len(summary[key]) > MOST_OF_A_GATE:
                console.print(f"and {len(summary[key]) - MOST_OF_A_GATE} more {key}, in results.json", soft_wrap=True)
        console.print(legible(summary["sentence"]), soft_wrap=True, markup=False)
    for sentence in left_out_in_words(results):
        console.print(f"{sentence}, and answers others", style="yellow", soft_wrap=True, markup=False)
    console.print(f"{last_line(results)}: {request.out / 'index.html'}", soft_wrap=True, markup=False)
