"""`rayproof run`: judge the tracer on cases or scene files, write a results folder and publish it."""

import errno
import os
import sys
from contextlib import ExitStack, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Group, Parameter

from rayproof.reports.commands.cluster import engaged, scheduler_at
from rayproof.reports.commands.lookup import Repeated, configurations, references_named
from rayproof.reports.commands.usage import UsageError, own, told_in_one_line, writable_folder
from rayproof.reports.results.files import legible
from rayproof.reports.run.cache_store import usual_limit

if TYPE_CHECKING:
    from rayproof.reports.history.gating import Demanded
    from rayproof.reports.subjects import Subject, Surroundings

# The headings of `run --help`, in their order.
SELECTION, SUBJECT, LIMITS, OUTPUT, GATE, CLUSTER = (
    Parameter(group=Group(heading, sort_key=place))
    for place, heading in enumerate(("Selection", "Subject", "Limits", "Output", "Gate", "Cluster"))
)
TRACER = "tracer"
USUAL_LIMIT = 120.0  # s, for one render or one judgement
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
    confine: Annotated[bool, SUBJECT] = False,
    diagnose: Annotated[Literal["auto", "off"], OUTPUT] = "auto",
    cache: Annotated[bool, LIMITS] = True,
    keep_images: Annotated[str | None, OUTPUT] = None,
    single_file: Annotated[bool, OUTPUT] = False,
    dry_run: Annotated[bool, SELECTION] = False,
    history: Annotated[Path | None, OUTPUT] = None,
    expect: Annotated[Path | None, GATE] = None,
    against: Annotated[Path | None, GATE] = None,
    least_coverage: Annotated[float | None, GATE] = None,
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
        Go on with the run that OUT holds; finished cases are not done again.
    shard
        Do one part of the cases only, such as 3/8: the third of eight, by a digest of each case's name. --merge
        puts the parts' folders together.
    merge
        Put the parts of a run together that --shard made, and publish them as one: SELECTORS are their folders. They
        are of the same code, plan, subject and demands; the cases of a part that is not there are missing.
    require
        A reference that must have a say, or several with commas: a case about which it can say nothing at all fails
        (of an optional program: a run); one that answers on request only is asked; one that is not installed ends the
        run. Repeatable.
    jobs
        Worker processes at once. Default: the number of processors.
    timeout
        Seconds that one render or one judgement may take; with --subject, one render of it. Default: 120, and more
        where a case is estimated to take longer for its size.
    worker_memory
        GiB of memory that one worker process may have; one that takes more is ended, and its render or judgement is an
        error. Default: no limit.
    configuration
        A tracer configuration, such as float32/triangle=signed_areas. Repeatable. Default: the suite's own list.
    formula
        A formula for every configuration, such as triangle=signed_areas, or a function of one's own as
        sphere=./mine.py:nearest_hit. Repeatable.
    subject
        Who is under test instead of the tracer: a reference by name, or "exec:COMMAND {scene} {output}".
    memory
        GiB of address space that a program under test may have.
    env
        A variable of the environment that a program under test gets beside PATH, HOME, TMPDIR, the locale and what
        concerns libraries, Python, Conda, CUDA and threads. Repeatable.
    confine
        Shut a program under test off (Linux): no network, no other processes, nothing to write but its folder; home and
        temporary folders and the cache are hidden.
    diagnose
        After a run with failures: put every known mistake to the test and name the one that explains them; or off.
    cache
        Take from the cache what references answered before, and what was found before of answers that are equal to
        the last bit. The renderer under test always renders. The cache takes RAYPROOF_CACHE_LIMIT GiB, or 2.
    keep_images
        Of which cases images are kept: `failed`, of those that did not pass; `sample:1%`, of such a share of the
        others too; or `all`, every renderer's of every case, as EXR. Default: of a case that passed the
        subject's and the oracle's in one compact file, without loss, of any other everything; of a run of more than
        2000 cases sample:1%. What is left out the command in a case's record makes again.
    single_file
        Also write report.html: the whole report in one file.
    dry_run
        Do nothing; print the plan and about how much time, memory and disk it takes.
    history
        Keep errors and times in this SQLite file, and say what became worse; `rayproof report history` shows it.
    expect
        A file of checks that are known to fail, as `rayproof gate accept` writes it. The exit code is 0 if all that
        fails is expected, and 1 if anything else fails, or something fails less or no longer.
    against
        The folder of an earlier run, or a history file (--history). The exit code is 1 if anything became worse than
        there, and 0 if all that fails did so there.
    least_coverage
        The share [%] of the checks that must be measured; with fewer the exit code is 1, whatever passes.
    json
        Also write results.json to this file.
    count
        With `random`: draw so many scenes, numbers 0 and up, with hostile features. Default: 100.
    seed
        With `random`: another seed draws other scenes. Default: 1.
    scenes
        Instead of selectors: a folder of scene files, or a file with a scene on each line and its `name` in it. They
        are read where they lie, however many they are.
    scheduler
        Where a cluster does the work: tls://HOST:PORT of a Dask scheduler, or local:N for one of N workers on this
        machine. Needs rayproof[dask]. --jobs is then each worker's, by default as many as its machine has processors;
        of local:N each has its share.
    tls
        With tls://HOST:PORT: the folder with the certificates that both ends show: ca.pem (of the authority), cert.pem
        and key.pem (ours).

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
    if merge:
        if any(
            (resume, shard, require, configuration, formula, subject != TRACER, dry_run, count, seed, scenes, scheduler)
        ):
            raise UsageError("--merge renders nothing: it goes with --out, --json, --single-file and what a gate asks")
        from rayproof.reports.commands.merge import merge as merge_parts

        with told_in_one_line():
            demanded = gate_demands(expect, against, least_coverage)
        code = merge_parts(tuple(map(Path, selectors)), out=out, demanded=demanded, history=history, json=json)
        from rayproof.reports.commands.report import write_one_file

        write_one_file(out, asked=single_file)
        return code
    piece = None
    if shard is not None:
        from rayproof.reports.run.shards import shard_of

        with told_in_one_line():
            piece = shard_of(shard)
    if piece is not None and not all(one is None for one in (expect, against, least_coverage, history)):
        raise UsageError("--expect, --against, --least-coverage and --history are for the whole: give them to --merge")
    selectors = drawn(selectors, count, seed)
    if scenes is not None and selectors:
        raise UsageError(f"--scenes says what is run, and so does {selectors[0]}")
    check_names(selectors)  # before anything is started for them
    if subject != TRACER and (configuration or formula):
        raise UsageError(
            "--configuration and --formula are the tracer's, and --subject puts another renderer under test"
        )
    with told_in_one_line():
        usual_limit()
    place = scheduler_at(scheduler, tls)
    patient, timeout = timeout is None, timeout or USUAL_LIMIT
    count = jobs or os.cpu_count() or 1
    from rayproof.reports.processes.scratch import scratch
    from rayproof.reports.run.workers import early_workers

    early = subject == TRACER and not dry_run and place is None
    with (
        scratch(),
        ExitStack() as engine,
        early_workers(jobs=count, timeout=timeout) if early else nullcontext() as pool,
    ):
        required = tuple(name.strip() for names in require for name in names.split(",") if name.strip())
        references_named(required)
        from rayproof.reports.run.options import RunOptions, images_to_keep
        from rayproof.reports.run.plan import panel
        from rayproof.reports.subjects import Surroundings

        with told_in_one_line():
            chosen = configurations(configuration, formula)
            surroundings = Surroundings(variables=env, confined=confine)
            tested = under_test(subject, seconds=timeout, memory=memory, surroundings=surroundings)
            check_selectors(selectors, tested)
            stream = None
            if scenes is not None:
                from rayproof.reports.run.scenes import SceneStream

                stream = SceneStream(scenes, tested)
            heard = panel(required, tested)
            demanded = gate_demands(expect, against, least_coverage)
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
            diagnose=diagnose == "auto",
        )
        cluster = None
        if place is not None and not dry_run:  # before anything is written
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
                lines = plan_in_words(request)
            sys.stdout.writelines(f"{legible(line)}\n" for line in lines)
            return 0
        try:
            from rayproof.reports.run.suite import run as run_suite

            code = run_suite(request, cluster or pool)
        except OSError as error:  # a full disk, say: what was finished is in the journal
            hint = f"{error.strerror or error}; what was finished is kept, and --resume goes on"
            raise OSError(error.errno, hint, error.filename or str(out)) from error
    # Not above: the tracer's worker should not wait until what prints tables is imported.
    from rayproof.reports.commands.report import write_one_file

    write_one_file(out, asked=single_file)
    return code


def gate_demands(expect: Path | None, against: Path | None, least_coverage: float | None) -> "Demanded | None":
    """Return what a gate demands of a run, None where it is nothing; raise ValueError or OSError for an unusable file.

    They are read now: OUT may be the folder of the earlier run, and its results are those that are compared with.
    """
    if expect is None and against is None and least_coverage is None:
        return None
    from rayproof.reports.history.expectations import load_expectations
    from rayproof.reports.history.gating import Demanded, load_base

    return Demanded(
        expected=None if expect is None else (str(expect), load_expectations(expect)),
        against=None if against is None else load_base(against),
        least_coverage=least_coverage,
    )


def drawn(selectors: tuple[str, ...], count: int | None, seed: int | None) -> tuple[str, ...]:
    """Return the selectors, with the names of so many random scenes in place of `random`.

    Raises:
        UsageError: --count or --seed without `random`, `random` beside other selectors, or a number out of range.

    """
    from rayproof.cases.random_scenes import FAMILY, LARGEST

    if FAMILY not in selectors:
        if count is not None or seed is not None:
            raise UsageError("--count and --seed draw random scenes: rayproof run random --count N --seed S")
        return selectors
    if len(selectors) > 1:
        raise UsageError(f"`{FAMILY}` is run by itself; one of its scenes is called {FAMILY}/SEED/NUMBER")
    count, seed = 100 if count is None else count, 1 if seed is None else seed
    if not 1 <= count <= MOST_DRAWN:
        raise UsageError(f"--count must be from 1 to {MOST_DRAWN} scenes, got {count}; another --seed draws others")
    if not 0 <= seed <= LARGEST:
        raise UsageError(f"--seed must be from 0 to {LARGEST}, got {seed}")
    return tuple(f"{FAMILY}/{seed}/{number}" for number in range(count))


def under_test(
    subject: str, *, seconds: float, memory: float, surroundings: "Surroundings", before_oracle: bool = True
) -> "Subject":
    """Return the subject that is named so; raise ValueError, LookupError or OSError if it cannot be put under test."""
    from rayproof.reports.run.workers import ask
    from rayproof.reports.subjects import THE_TRACER
    from rayproof.reports.subjects.choosing import chosen

    if subject == TRACER:
        if surroundings.variables or surroundings.confined:
            raise ValueError("--env and --confine are for a program under test: --subject 'exec:COMMAND'")
        return THE_TRACER
    return chosen(
        subject,
        seconds=seconds,
        memory=int(memory * 2**30),
        ask=ask,
        surroundings=surroundings,
        before_oracle=before_oracle,
    )


def subject_named(
    subject: str, env: tuple[str, ...] = (), *, confine: bool = False, seconds: float = USUAL_LIMIT
) -> "Subject":
    """Return the subject that is named so, with the usual limits; one line says why it cannot be put under test."""
    from rayproof.reports.subjects import Surroundings

    with told_in_one_line():
        surroundings = Surroundings(variables=env, confined=confine)
        return under_test(subject, seconds=seconds, memory=8.0, surroundings=surroundings, before_oracle=False)


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
