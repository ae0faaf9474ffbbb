"""`rayproof run`: judge the tracer on cases or scene files, write a results folder and publish it."""

import errno
import os
import sys
from contextlib import ExitStack, nullcontext, redirect_stdout
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Group, Parameter

from rayproof.reports.commands.lookup import (
    TRACER,
    USUAL_LIMIT,
    Repeated,
    configurations,
    references_named,
    under_test,
)
from rayproof.reports.commands.output import say
from rayproof.reports.commands.usage import UsageError, own, told_in_one_line, writable_folder
from rayproof.reports.results.files import legible
from rayproof.reports.run.cache_store import usual_limit

if TYPE_CHECKING:
    from rayproof.reports.history.gating import Demanded
    from rayproof.reports.subjects import Subject

# The headings of `run --help`, in their order.
SELECTION, SUBJECT, LIMITS, OUTPUT, GATE, CLUSTER = (
    Parameter(group=Group(heading, sort_key=place))
    for place, heading in enumerate(("Selection", "Subject", "Limits", "Output", "Gate", "Cluster"))
)
MOST_DRAWN = 10_000  # random scenes, all of which are held in memory
MOST_MEMORY = 2.0**33  # GiB; a process's limits are numbers of 63 bits


def run(
    *selectors: str,
    out: Annotated[Path, OUTPUT] = Path("report"),
    resume: Annotated[bool, SELECTION] = False,
    shard: Annotated[str | None, SELECTION] = None,
    merge: Annotated[bool, SELECTION] = False,
    require: Annotated[Repeated, SUBJECT] = (),
    jobs: Annotated[int | None, LIMITS] = None,
    timeout: Annotated[float | None, LIMITS] = None,
    worker_memory: Annotated[float | None, LIMITS] = None,
    configuration: Annotated[Repeated, SUBJECT] = (),
    formula: Annotated[Repeated, SUBJECT] = (),
    subject: Annotated[str, SUBJECT] = "tracer",
    memory: Annotated[float, LIMITS] = 8.0,
    env: Annotated[Repeated, SUBJECT] = (),
    declare: Annotated[Path | None, SUBJECT] = None,
    diagnose: Annotated[Literal["auto", "off"], OUTPUT] = "auto",
    cache: Annotated[bool, LIMITS] = True,
    keep_images: Annotated[str | None, OUTPUT] = None,
    single_file: Annotated[bool, OUTPUT] = False,
    studies: Annotated[bool, OUTPUT] = False,
    dry_run: Annotated[bool, SELECTION] = False,
    history: Annotated[Path | None, OUTPUT] = None,
    expect: Annotated[Path | None, GATE] = None,
    patterns: Annotated[bool, GATE, Parameter(name="--any")] = False,
    against: Annotated[Path | None, GATE] = None,
    least_coverage: Annotated[float | None, SUBJECT] = None,
    json: Annotated[Path | None, OUTPUT] = None,
    count: Annotated[int | None, SELECTION] = None,
    seed: Annotated[int | None, SELECTION] = None,
    scenes: Annotated[Path | None, SELECTION] = None,
    scheduler: Annotated[str | None, CLUSTER] = None,
    tls: Annotated[Path | None, CLUSTER] = None,
) -> int:
    """Judge the tracer or another renderer on cases or scene files; write a report.

    Parameters
    ----------
    selectors
        Families, family/case names, patterns such as `shadow/*`, or scene files ending in .json. Default: all cases.
        `random` draws scenes: see --count; random/SEED/NUMBER is one of them.
    out
        Folder for results and report.
    resume
        Reuse OUT's results for cases whose scene, code and references are unchanged.
    shard
        Run one part of the cases only, such as 3/8, the third of eight. --merge combines the parts' folders.
    merge
        Combine the parts that --shard made into one run; SELECTORS are their folders. All parts must have the same
        code, plan, subject and options. Cases of an absent part are missing.
    require
        References that must answer, separated by commas: a case that one of them cannot answer at all fails. Beside the
        panel, certified and double_double, which answer on request only. Repeatable.
    jobs
        Worker processes at once. Default: the number of processors.
    timeout
        Time limit [s] of one render or one judgement. Default: 120, and more for large cases.
    worker_memory
        Memory limit [GiB] of one worker process. A render or judgement that exceeds it is an error. Default: no limit.
    configuration
        A tracer configuration, such as float32/triangle=signed_areas. Repeatable. Default: the suite's own list.
    formula
        A formula for every configuration, such as triangle=signed_areas, or a function of your own, such as
        sphere=./mine.py:nearest_hit. Repeatable.
    subject
        The renderer under test instead of the tracer: a reference by name, "exec:COMMAND {scene} {output}" (called for
        each scene), "serve:COMMAND" (started once), or "python:FILE.py:FUNCTION". {scene.xml}, {scene.gltf},
        {scene.pbrt} and {scene.pov} hand the scene over in other formats; {output.pfm}, {output.hdr} and {output.png}
        name other pictures.
    memory
        Limit [GiB] of the address space of a program under test.
    env
        An environment variable to pass to a program under test. PATH, HOME, TMPDIR, the locale and variables of
        libraries, Python, Conda, CUDA and threads are always passed. Repeatable.
    declare
        A JSON file with what a program under test does not say itself: its capabilities, the file that it always
        `writes`, and the `transfer` curve of its pictures.
    diagnose
        auto: after a run with failures, look for the known mistake that explains them. off: do not look.
    cache
        Reuse answers of references, and verdicts on bit-identical images, from the cache. The renderer under test
        always renders. The cache holds up to RAYPROOF_CACHE_LIMIT GiB, by default 2.
    keep_images
        The cases whose images are kept. failed: cases that did not pass. sample:1%: these and one per cent of the
        others. all: every renderer's images of every case, as EXR. Default: all images of cases that did not pass, and
        the subject's and the oracle's of the others; with more than 2000 cases sample:1%. Without all, images of cases
        that did not pass take at most 60 MB, those of the worst; the others keep a preview.
    single_file
        Also write report.html: the report in one file of at most 8 MB, with what fails and the worst ten cases.
    studies
        Also measure the ladders and the trade-off of error and time, as `rayproof stability --quick` and `rayproof
        tradeoff --quick` do, into the same report.
    dry_run
        Print the plan and an estimate of time, memory and disk, and run nothing.
    history
        Append errors and times to this SQLite file and report what became worse; `rayproof report history` shows it.
    expect
        A file of known failures, as `rayproof gate accept` writes it. The exit code is 0 while exactly these failures
        occur, and 1 if there is a new failure, a missing one or a smaller one.
    patterns
        With --expect: let the file's entries name cases and checks by patterns, such as shadows/*, or leave out where
        pixels are wrong. Without it such a file is refused.
    against
        The folder of an earlier run, or a history file (--history). The exit code is 1 if anything became worse, and 0
        if everything that fails failed there too.
    least_coverage
        The least share [%] of the cases that must be answered. With fewer, if nothing fails, the exit code is 3.
        Default: 50, or 0 with --expect or --against.
    json
        Also write results.json to this file.
    count
        With `random`: the number of scenes with hostile features to draw. Default: 100.
    seed
        With `random`: the seed of the scenes. Default: 1.
    scenes
        Instead of selectors: a folder of scene files, or a file with one scene, with a `name`, on each line.
    scheduler
        A Dask cluster that runs the cases: tls://HOST:PORT of a scheduler, or local:N for N workers on this machine.
        Needs Dask distributed. --jobs then counts for each worker; by default a worker uses all processors of its
        machine, or its share with local:N.
    tls
        With tls://HOST:PORT: the folder with ca.pem (the authority's certificate), cert.pem and key.pem (this end's).

    """
    if timeout is not None and not timeout > 0:
        raise UsageError(f"--timeout must be positive, got {timeout} s")
    if worker_memory is not None and not 0 < worker_memory < MOST_MEMORY:
        raise UsageError(f"--worker-memory must be positive and below {MOST_MEMORY:g}, got {worker_memory} GiB")
    if jobs is not None and jobs < 1:
        raise UsageError(f"--jobs must be at least 1, got {jobs}")
    if not 0 < memory < MOST_MEMORY:
        raise UsageError(f"--memory must be positive and below {MOST_MEMORY:g}, got {memory} GiB")
    if least_coverage is not None and not 0 <= least_coverage <= 100:
        raise UsageError(f"--least-coverage must be from 0 to 100 %, got {least_coverage}")
    if studies and (merge or shard or dry_run or scheduler or subject != TRACER):
        raise UsageError(
            "--studies measures the tracer's formulas: without --merge, --shard, --dry-run, --scheduler, --subject"
        )
    if merge:
        if any(
            (
                resume,
                shard,
                require,
                configuration,
                formula,
                subject != TRACER,
                declare,
                dry_run,
                count,
                seed,
                scenes,
                scheduler,
            )
        ):
            raise UsageError(
                "--merge renders nothing and takes only --out, --json, --single-file, --history and the gate's options"
            )
        from rayproof.reports.commands.merge import merge as merge_parts

        with told_in_one_line():
            demanded = gate_demands(expect, against, patterns=patterns)
        about = {"demanded": demanded, "least_coverage": least_coverage, "history": history, "json": json}
        code = merge_parts(tuple(map(Path, selectors)), out=out, **about)
        from rayproof.reports.commands.report import write_one_file

        write_one_file(out, asked=single_file)
        return code
    piece = None
    if shard is not None:
        from rayproof.reports.run.shards import shard_of

        with told_in_one_line():
            piece = shard_of(shard)
    if piece is not None and not all(one is None for one in (expect, against, least_coverage, history)):
        raise UsageError("--expect, --against, --least-coverage and --history need the whole run: give them to --merge")
    selectors = drawn(selectors, count, seed)
    if scenes is not None and selectors:
        raise UsageError(f"--scenes and selectors exclude each other, got both: {selectors[0]}")
    check_names(selectors)  # before anything is started for them
    if subject != TRACER and (configuration or formula):
        raise UsageError("--configuration and --formula apply to the tracer only and exclude --subject")
    with told_in_one_line():
        usual_limit()
    place = None
    if scheduler is not None or tls is not None:
        from rayproof.reports.commands.cluster import scheduler_at

        place = scheduler_at(scheduler, tls)
    patient, timeout = timeout is None, timeout or USUAL_LIMIT
    count = jobs or os.cpu_count() or 1
    from rayproof.reports.processes.scratch import scratch
    from rayproof.reports.run.workers import early_workers

    stays = subject.startswith(("serve:", "python:"))  # a program that is started once: to be asked what it can, too
    early = place is None and (stays or (subject == TRACER and not dry_run))
    with (
        scratch(),
        ExitStack() as engine,
        early_workers(subject, jobs=count, timeout=timeout) if early else nullcontext() as pool,
    ):
        required = tuple(name.strip() for names in require for name in names.split(",") if name.strip())
        references_named(required)
        from rayproof.reports.run.options import RunOptions, images_to_keep
        from rayproof.reports.run.plan import panel

        with told_in_one_line():
            chosen = configurations(configuration, formula)
            about = {"seconds": timeout, "memory": memory, "variables": env, "declare": declare}
            tested = under_test(subject, **about, pool=pool if stays else None)
            check_selectors(selectors, tested)
            stream = None
            if scenes is not None:
                from rayproof.reports.run.scenes import SceneStream

                stream = SceneStream(scenes, tested, say=say)
            heard = panel(required, tested)
            demanded = gate_demands(expect, against, patterns=patterns)
            kept = images_to_keep(keep_images, cases=len(selectors if stream is None else stream))
        request = RunOptions(
            selectors=selectors,
            scenes=stream,
            out=out,
            resume=resume,
            shard=piece,
            require=required,
            subject=tested,
            cached=cache,
            jobs=count,
            timeout=timeout,
            worker_memory=float("inf") if worker_memory is None else worker_memory * 2**30,
            patient=patient,
            configurations=tuple(one.name for one in chosen),
            json=json,
            images=kept,
            history=history,
            demanded=demanded,
            least_coverage=least_coverage,
            diagnose=diagnose == "auto",
        )
        cluster = None
        if place is not None and not dry_run:  # before anything is written
            from rayproof.reports.commands.cluster import engaged

            share = max(1, count // place.local) if place.local else jobs
            cluster = engine.enter_context(engaged(place, request, heard.names, jobs=share))
        with told_in_one_line():
            if not dry_run:
                own(out)
            if history is not None and not dry_run:
                from rayproof.reports.history.database import opened

                writable_folder(history.parent)
                with opened(history, create=True):
                    pass  # it is one, and can be written
            if json is not None and not dry_run:
                writable_folder(json.parent)
                if json.is_dir():
                    raise IsADirectoryError(errno.EISDIR, "is a folder, not a file to write", str(json))
        if dry_run:
            from rayproof.reports.run.dry_run import plan_in_words

            with told_in_one_line():
                lines = plan_in_words(request, pool)
            sys.stdout.writelines(f"{legible(line)}\n" for line in lines)
            return 0
        if studies:
            study(out)
        try:
            from rayproof.reports.run.suite import run as run_suite

            code = run_suite(request, cluster or pool)
            from rayproof.reports.results.provenance import keep

            keep(out, "run", "" if seed is None else seed)
        except OSError as error:  # a full disk, say: what was finished is in the journal
            hint = f"{error.strerror or error}; what was finished is kept, and --resume goes on"
            raise OSError(error.errno, hint, error.filename or str(out)) from error
    # Not above: the tracer's worker should not wait until what prints tables is imported.
    from rayproof.reports.commands.report import write_one_file

    write_one_file(out, asked=single_file)
    return code


def study(out: Path) -> None:
    """Measure the quick ladders and the quick trade-off into OUT; only what each comes to is said.

    Before the run, whose verdict is then the last that is said, and which publishes all of it. They decide nothing.
    """
    from rayproof.reports.commands.stability import stability
    from rayproof.reports.commands.tradeoff import tradeoff

    for name, measure in (("stability", stability), ("tradeoff", tradeoff)):
        with redirect_stdout(StringIO()) as told:
            measure(quick=True, out=out)
        sys.stderr.write(f"{name}: {told.getvalue().strip().splitlines()[-1]}\n")


def gate_demands(expect: Path | None, against: Path | None, *, patterns: bool) -> "Demanded | None":
    """Return what a gate demands of a run, None where it is nothing; raise ValueError or OSError for an unusable file.

    They are read now: OUT may be the folder of the earlier run, and its results are those that are compared with.
    """
    if expect is None and against is None:
        return None
    from rayproof.reports.history.expectations import load_known
    from rayproof.reports.history.gating import Demanded, load_base

    return Demanded(
        expected=None if expect is None else (str(expect), load_known(expect, patterns=patterns)),
        against=None if against is None else load_base(against),
    )


def drawn(selectors: tuple[str, ...], count: int | None, seed: int | None) -> tuple[str, ...]:
    """Return the selectors, with the names of so many random scenes in place of `random`.

    Raises:
        UsageError: --count or --seed without `random`, `random` beside other selectors, or a number out of range.

    """
    from rayproof.cases.families import RANDOM as FAMILY

    if FAMILY not in selectors:
        if count is not None or seed is not None:
            raise UsageError("--count and --seed draw random scenes: rayproof run random --count N --seed S")
        return selectors
    from rayproof.cases.random_scenes import LARGEST

    if len(selectors) > 1:
        raise UsageError(f"`{FAMILY}` is run by itself; one of its scenes is called {FAMILY}/SEED/NUMBER")
    count, seed = 100 if count is None else count, 1 if seed is None else seed
    if not 1 <= count <= MOST_DRAWN:
        raise UsageError(f"--count must be from 1 to {MOST_DRAWN} scenes, got {count}; another --seed draws others")
    if not 0 <= seed <= LARGEST:
        raise UsageError(f"--seed must be from 0 to {LARGEST}, got {seed}")
    return tuple(f"{FAMILY}/{seed}/{number}" for number in range(count))


def check_names(selectors: tuple[str, ...]) -> None:
    """Raise UsageError for the first selector that names no case; scene files are looked at later."""
    from rayproof.cases.families import select

    with told_in_one_line():
        for selector in selectors:
            if not selector.endswith(".json"):
                select([selector])


def check_selectors(selectors: tuple[str, ...], subject: "Subject") -> None:
    """Raise ValueError, LookupError or OSError for the first selector that names no case and no valid scene file."""
    from rayproof.cases.families import select
    from rayproof.reports.run.scenes import case_of_file, refuse_beyond_all

    for selector in selectors:
        if selector.endswith(".json"):
            refuse_beyond_all(case_of_file(Path(selector)), selector)
        else:
            select([selector])
