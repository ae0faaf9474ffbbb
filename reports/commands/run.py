"""`rayproof run` and `rayproof random`: judge a renderer on cases, write a results folder and publish it."""

import errno
import os
import sys
from contextlib import ExitStack, nullcontext
from dataclasses import dataclass
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

# The headings of `run --help`, in their order.
SELECTION, SUBJECT, LIMITS, OUTPUT, GATE, CLUSTER = (
    Parameter(group=Group(heading, sort_key=place))
    for place, heading in enumerate(("Selection", "Subject", "Limits", "Output", "Gate", "Cluster"))
)
MOST_DRAWN = 10_000  # random scenes; all are in memory at once
MOST_MEMORY = 2.0**33  # GiB; a process's limits have 63 bits
WORKER_MEMORY = "RAYPROOF_WORKER_MEMORY"


@dataclass(frozen=True, kw_only=True)
class Settings:
    """The options of a command that judges cases.

    Parameters
    ----------
    out
        Folder for results and report.
    resume
        Reuse OUT's results for cases whose scene, code and references are unchanged.
    shard
        Run only one part of the cases, such as 3/8, the third of eight parts. `rayproof merge` merges the parts'
        folders.
    require
        References that must render every case, separated by commas: a case fails if one of them has no answer to it.
        Besides the usual references, certified may be named, which renders only on request. Repeatable.
    jobs
        Worker processes at once. Default: the number of processors.
    timeout
        Time limit [s] of one render or one judgement. Default: 120, and more for large cases.
    configuration
        A tracer configuration, such as float32/triangle=signed_areas. Repeatable. Default: the suite's own list.
    formula
        A formula for every configuration, such as triangle=signed_areas, or a function of your own, such as
        sphere=./mine.py:nearest_hit. Repeatable.
    subject
        The renderer under test instead of the tracer: a reference by name, "exec:COMMAND {scene} {output}" (called for
        each scene), "serve:COMMAND" (started once), or "python:FILE.py:FUNCTION". {scene.xml}, {scene.gltf},
        {scene.pbrt} and {scene.pov} pass the scene in other formats; {output.pfm}, {output.hdr} and {output.png} ask
        for other image formats.
    memory
        Limit [GiB] of the address space of a program under test. The environment variable RAYPROOF_WORKER_MEMORY limits
        each worker process of rayproof in the same way; by default they have no limit.
    env
        An environment variable to pass to a program under test. PATH, HOME, TMPDIR, the locale and variables of
        libraries, Python, Conda, CUDA and threads are always passed. Repeatable.
    declare
        A JSON file with properties of a program under test that it does not declare itself: its capabilities, the file
        that it always `writes`, and the `transfer` curve of its pictures.
    diagnose
        auto: after a run with failures, search for the known mistake that explains them. off: do not search.
    cache
        Reuse cached renders of references, and cached verdicts on bit-identical images. The renderer under test always
        renders. The cache grows to at most RAYPROOF_CACHE_LIMIT GiB, by default 2.
    keep_images
        The cases whose images are kept. failed: cases that did not pass. sample:1%: these and one per cent of the
        others. all: every renderer's images of every case, as EXR. Default: all images of cases that did not pass, and
        the subject's and the oracle's images of the others; with more than 2000 cases sample:1%. Except with all, at
        most 60 MB of images of cases that did not pass are kept, beginning with the worst; the remaining cases keep a
        preview.
    dry_run
        Print the plan and an estimate of time, memory and disk, and run nothing.
    json
        Also write results.json to this file.
    scheduler
        A Dask cluster that runs the cases: tls://HOST:PORT of a scheduler, or local:N for N workers on this machine.
        Needs Dask distributed. --jobs is then the number of processes of each worker; by default a worker uses all
        processors of its machine, or its share of them with local:N.
    tls
        With tls://HOST:PORT: the folder with ca.pem, the authority's certificate, and with cert.pem and key.pem, the
        certificate and key of this machine.

    """

    out: Annotated[Path, OUTPUT] = Path("report")
    resume: Annotated[bool, SELECTION] = False
    shard: Annotated[str | None, SELECTION] = None
    require: Annotated[Repeated, SUBJECT] = ()
    jobs: Annotated[int | None, LIMITS] = None
    timeout: Annotated[float | None, LIMITS] = None
    configuration: Annotated[Repeated, SUBJECT] = ()
    formula: Annotated[Repeated, SUBJECT] = ()
    subject: Annotated[str, SUBJECT] = TRACER
    memory: Annotated[float, LIMITS] = 8.0
    env: Annotated[Repeated, SUBJECT] = ()
    declare: Annotated[Path | None, SUBJECT] = None
    diagnose: Annotated[Literal["auto", "off"], OUTPUT] = "auto"
    cache: Annotated[bool, LIMITS] = True
    keep_images: Annotated[str | None, OUTPUT] = None
    dry_run: Annotated[bool, SELECTION] = False
    json: Annotated[Path | None, OUTPUT] = None
    scheduler: Annotated[str | None, CLUSTER] = None
    tls: Annotated[Path | None, CLUSTER] = None

    def check(self) -> None:
        """Raise UsageError for a number out of range."""
        if self.timeout is not None and not self.timeout > 0:
            raise UsageError(f"--timeout must be positive, got {self.timeout} s")
        if self.jobs is not None and self.jobs < 1:
            raise UsageError(f"--jobs must be at least 1, got {self.jobs}")
        if not 0 < self.memory < MOST_MEMORY:
            raise UsageError(f"--memory must be positive and below {MOST_MEMORY:g}, got {self.memory} GiB")
        if self.subject != TRACER and (self.configuration or self.formula):
            raise UsageError("--configuration and --formula apply to the tracer only and exclude --subject")


@dataclass(frozen=True, kw_only=True)
class GateOptions:
    """The options of the gate, which compares a whole run with known failures or an earlier run.

    Parameters
    ----------
    expect
        A file of known failures, as `rayproof gate accept` writes it. The exit code is 0 if exactly these failures
        occur, and 1 if there is a new failure, or if a known failure is missing or smaller.
    patterns
        With --expect: allow the file's entries to name cases and checks by patterns, such as shadows/*, or to omit the
        positions of wrong pixels. Without this option such a file is refused.
    against
        The folder of an earlier run, or a history file (--history). The exit code is 1 if anything became worse, and 0
        if everything that fails also failed there.
    least_coverage
        The smallest share [%] of the cases that must be answered. If fewer are answered and nothing fails, the exit
        code is 3. Default: 50, or 0 with --expect or --against.
    history
        Append errors and times to this SQLite file, and report the cases that became worse. `rayproof report history`
        shows the file.

    """

    expect: Annotated[Path | None, GATE] = None
    patterns: Annotated[bool, GATE, Parameter(name="--any")] = False
    against: Annotated[Path | None, GATE] = None
    least_coverage: Annotated[float | None, GATE] = None
    history: Annotated[Path | None, GATE] = None

    def demanded(self) -> "Demanded | None":
        """Return the gate's demands, or None without any; raise ValueError or OSError for an unusable file.

        The files are read before the run, since OUT may be the folder of the earlier run and replace its results.
        """
        if self.least_coverage is not None and not 0 <= self.least_coverage <= 100:
            raise ValueError(f"--least-coverage must be from 0 to 100 %, got {self.least_coverage}")
        if self.expect is None and self.against is None:
            return None
        from rayproof.reports.history.expectations import load_known
        from rayproof.reports.history.gating import Demanded, load_base

        file = self.expect
        return Demanded(
            expected=None if file is None else (str(file), load_known(file, patterns=self.patterns)),
            against=None if self.against is None else load_base(self.against),
        )


FLAT = Parameter(name="*")  # make the fields of a dataclass options of the command
USUAL, NO_GATE = Settings(), GateOptions()


def run(
    *selectors: str, settings: Annotated[Settings, FLAT] = USUAL, gate: Annotated[GateOptions, FLAT] = NO_GATE
) -> int:
    """Judge the tracer or another renderer on cases or scene files; write a report.

    For example: rayproof run primitives "shadows/*" --subject "exec:./mine {scene} {output}" --out mine

    Parameters
    ----------
    selectors
        Families, family/case names, patterns such as `shadows/*`, or scene files ending in .json. Default: all cases.
        Or a single folder of scene files, ending in /, or a single .jsonl file with a scene and its `name` on each
        line.

    """
    return judged(selectors, settings, gate)


def random(
    *,
    count: Annotated[int, SELECTION] = 100,
    seed: Annotated[int, SELECTION] = 1,
    settings: Annotated[Settings, FLAT] = USUAL,
    gate: Annotated[GateOptions, FLAT] = NO_GATE,
) -> int:
    """Judge the tracer or another renderer on random scenes with hostile features; write a report.

    `rayproof run random/SEED/NUMBER` judges the scene with this number again.

    For example: rayproof random --count 400 --seed 7 --subject "exec:./mine {scene} {output}" --out mine

    Parameters
    ----------
    count
        The number of scenes.
    seed
        The seed of the scenes. Scene NUMBER of a seed is always the same.

    """
    from rayproof.cases.random_scenes import FAMILY, LARGEST

    if not 1 <= count <= MOST_DRAWN:
        raise UsageError(f"--count must be from 1 to {MOST_DRAWN} scenes, got {count}; another --seed draws others")
    if not 0 <= seed <= LARGEST:
        raise UsageError(f"--seed must be from 0 to {LARGEST}, got {seed}")
    return judged(tuple(f"{FAMILY}/{seed}/{number}" for number in range(count)), settings, gate, seed=str(seed))


def judged(selectors: tuple[str, ...], settings: Settings, gate: GateOptions, *, seed: str = "") -> int:
    """Run the cases that `selectors` name and publish the results; return the exit code."""
    settings.check()
    piece = None
    if settings.shard is not None:
        from rayproof.reports.run.shards import shard_of

        with told_in_one_line():
            piece = shard_of(settings.shard)
        if gate != NO_GATE:
            raise UsageError("--shard runs a part, and a gate needs the whole run: give its options to rayproof merge")
    streams = [selector for selector in selectors if selector.endswith((".jsonl", "/"))]
    if streams and len(selectors) > 1:
        raise UsageError(f"{streams[0]}: a folder of scenes, or a file of them, is run by itself")
    check_names(() if streams else selectors)  # before any process is started
    with told_in_one_line():
        usual_limit()
        worker_memory = memory_of_workers()
    place = None
    if settings.scheduler is not None or settings.tls is not None:
        from rayproof.reports.commands.cluster import scheduler_at

        place = scheduler_at(settings.scheduler, settings.tls)
    out, subject, dry_run = settings.out, settings.subject, settings.dry_run
    timeout = settings.timeout or USUAL_LIMIT
    jobs = settings.jobs or os.cpu_count() or 1
    from rayproof.reports.processes.scratch import scratch
    from rayproof.reports.run.workers import early_workers

    stays = subject.startswith(("serve:", "python:"))  # the program is started once, also to read its capabilities
    early = place is None and (stays or (subject == TRACER and not dry_run))
    with (
        scratch(),
        ExitStack() as engine,
        early_workers(subject, jobs=jobs, timeout=timeout) if early else nullcontext() as pool,
    ):
        required = tuple(name.strip() for names in settings.require for name in names.split(",") if name.strip())
        references_named(required)
        from rayproof.reports.run.options import RunOptions, images_to_keep
        from rayproof.reports.run.plan import panel

        with told_in_one_line():
            chosen = configurations(settings.configuration, settings.formula)
            about = {"seconds": timeout, "memory": settings.memory, "variables": settings.env}
            tested = under_test(subject, **about, declare=settings.declare, pool=pool if stays else None)
            stream = None
            if streams:
                from rayproof.reports.run.scenes import SceneStream

                stream = SceneStream(Path(streams[0]), tested, say=say)
            else:
                check_selectors(selectors)
            references = panel(required, tested)
            demanded = gate.demanded()
            kept = images_to_keep(settings.keep_images, cases=len(selectors if stream is None else stream))
        request = RunOptions(
            selectors=() if streams else selectors,
            scenes=stream,
            out=out,
            resume=settings.resume,
            shard=piece,
            require=required,
            subject=tested,
            cached=settings.cache,
            jobs=jobs,
            timeout=timeout,
            worker_memory=worker_memory,
            patient=settings.timeout is None,
            configurations=tuple(configuration.name for configuration in chosen),
            json=settings.json,
            images=kept,
            history=gate.history,
            demanded=demanded,
            least_coverage=gate.least_coverage,
            diagnose=settings.diagnose == "auto",
        )
        if dry_run:
            from rayproof.reports.run.dry_run import plan_in_words

            with told_in_one_line():
                lines = plan_in_words(request, pool)
            sys.stdout.writelines(f"{legible(line)}\n" for line in lines)
            return 0
        cluster = None
        if place is not None:  # connect before anything is written
            from rayproof.reports.commands.cluster import engaged

            share = max(1, jobs // place.local) if place.local else settings.jobs
            cluster = engine.enter_context(engaged(place, request, references.names, jobs=share))
        with told_in_one_line():
            own(out)
            if gate.history is not None:
                from rayproof.reports.history.database import opened

                writable_folder(gate.history.parent)
                with opened(gate.history, create=True):
                    pass  # the file is a history and can be written
            if settings.json is not None:
                writable_folder(settings.json.parent)
                if settings.json.is_dir():
                    raise IsADirectoryError(errno.EISDIR, "is a folder, not a file to write", str(settings.json))
        try:
            from rayproof.reports.run.suite import run as run_suite

            code = run_suite(request, cluster or pool)
            from rayproof.reports.results.provenance import keep

            keep(out, "run", seed)
        except OSError as error:  # for example a full disk; finished cases are in the journal
            hint = f"{error.strerror or error}; what was finished is kept, and --resume goes on"
            raise OSError(error.errno, hint, error.filename or str(out)) from error
    # Import late: the tracer's worker should not wait for the import of the modules that print tables.
    from rayproof.reports.commands.report import write_one_file

    write_one_file(out, asked=False)
    return code


def memory_of_workers() -> float:
    """Return the memory limit [bytes] of a worker process, inf without a limit; raise ValueError if it is invalid."""
    text = os.environ.get(WORKER_MEMORY)
    if not text:
        return float("inf")
    try:
        limit = float(text)
    except ValueError:
        limit = 0.0
    if not 0 < limit < MOST_MEMORY:
        raise ValueError(f"{WORKER_MEMORY} is a number of GiB, positive and below {MOST_MEMORY:g}, got {text!r}")
    return limit * 2**30


def check_names(selectors: tuple[str, ...]) -> None:
    """Raise UsageError for the first selector that names no case; scene files are checked later."""
    from rayproof.cases.families import select

    with told_in_one_line():
        for selector in selectors:
            if not selector.endswith(".json"):
                select([selector])


def check_selectors(selectors: tuple[str, ...]) -> None:
    """Raise ValueError, LookupError or OSError for the first selector that is neither a case nor a valid scene file."""
    from rayproof.cases.families import select
    from rayproof.reports.run.scenes import case_of_file, refuse_beyond_all

    for selector in selectors:
        if selector.endswith(".json"):
            refuse_beyond_all(case_of_file(Path(selector)), selector)
        else:
            select([selector])
