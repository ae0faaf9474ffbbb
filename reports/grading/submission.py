"""One submission: its folder is copied, built in an enclosure, run on every case and judged."""

import hashlib
import os
import shlex
import shutil
import stat
import sys
import tempfile
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path

import msgspec
import platformdirs
from rich.console import Console

from rayproof import ROOT
from rayproof.reports.grading.rubric import Program, Rubric, check_program
from rayproof.reports.results.document import save_early, save_results
from rayproof.reports.results.files import legible
from rayproof.reports.results.records import RunRecord
from rayproof.reports.run.cache_store import usual_store
from rayproof.reports.run.options import RunOptions
from rayproof.reports.run.plan import panel, plan, with_some_twice
from rayproof.reports.run.suite import find_out
from rayproof.reports.run.totals import of, results_document
from rayproof.reports.run.workers import workers
from rayproof.reports.run.workload import render_and_judge
from rayproof.reports.subjects import PROGRAM, WAITING, Enclosure, Subject, Surroundings
from rayproof.reports.subjects.calls import call
from rayproof.reports.subjects.program import ask_capabilities

SYSTEM = (
    "/usr", "/bin", "/sbin", "/lib", "/lib32", "/lib64", "/etc/alternatives", "/etc/ld.so.cache", "/etc/ld.so.conf",
    "/etc/ld.so.conf.d",
)  # fmt: skip
USUAL = {"PATH": "/usr/local/bin:/usr/bin:/bin", "HOME": "/tmp", "TMPDIR": "/tmp", "LANG": "C.UTF-8"}
OWN = "rayproof.toml"  # of a submission
CALLED = "submission"  # what every submission's command is called in a run's records
ROOM = 2  # times what all may hold: the address space of one process
MOST_PRINTED = 4000  # characters of what a build printed
CALLS = 10  # times --timeout: a call may wait for others, and be made again


class SubmissionError(Exception):
    """Why a submission cannot be run at all, in a sentence for its student."""


@dataclass(frozen=True, kw_only=True)
class Place:
    """Where a class is graded."""

    submissions: Path
    out: Path
    confined: bool

    @property
    def teacher(self) -> Path:
        """Return the folder of everything that no student may see."""
        return self.out / "teacher"


def secrets(rubric: Rubric, place: Place) -> list[Path]:
    """Return what no submission may read: the right answers, the rubric, other students' folders, grades."""
    cache = os.environ.get("RAYPROOF_CACHE") or platformdirs.user_cache_dir("rayproof")
    own = [ROOT, Path(cache), *([Path(sys.prefix)] if sys.prefix != sys.base_prefix else [])]
    return [path.resolve() for path in (*own, rubric.path, place.submissions, place.out)]


def readable(rubric: Rubric, place: Place) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the folders that a submission may read beside its own, and those below them that it finds empty.

    Raises:
        ValueError: a folder of the rubric lies where the answers lie, or the rubric itself in a readable one.

    """
    allowed = [*filter(os.path.exists, SYSTEM), *rubric.file.readable.folders]
    hidden = secrets(rubric, place)
    masked = []
    for path in map(Path, allowed):
        real = path.resolve()
        for secret in hidden:
            if real.is_relative_to(secret):
                raise ValueError(f"readable.folders: {path} lies in {secret}, which no submission may read")
            if secret.is_relative_to(real):
                if not secret.is_dir():
                    raise ValueError(f"{secret} lies in {path}, which submissions may read: move it elsewhere")
                masked.append(str(secret))
    return tuple(allowed), tuple(dict.fromkeys(masked))


def enclosure(rubric: Rubric, place: Place, submission: Path, *, products: Path | None) -> Enclosure:
    """Return what a submission finds: when it is built, where its `products` are written; else when it is run."""
    limits, (allowed, masked) = rubric.file.limits, readable(rubric, place)
    return Enclosure(
        submission=str(submission.resolve()),
        allowed=allowed,
        masked=masked,
        environment=tuple((USUAL | rubric.file.readable.environment).items()),
        processes=limits.processes,
        memory=int(limits.memory * 2**30),
        disk=int(limits.disk * 2**20),
        seconds=limits.build_seconds if products is not None else limits.seconds,
        products=None if products is None else str(products),
        turns=str(place.teacher / "turns"),
        confined=place.confined,
    )


def files(folder: Path) -> Iterator[Path]:
    """Yield the files below a folder that was handed in, sorted by their names.

    Raises:
        SubmissionError: something in it is neither file nor folder.

    """
    for where, names, inside in os.walk(folder):
        names.sort()
        for name in (*names, *sorted(inside)):
            path = Path(where, name)
            mode = path.lstat().st_mode
            if not (stat.S_ISREG(mode) or stat.S_ISDIR(mode)):
                kind = "a link" if stat.S_ISLNK(mode) else "a special file"
                raise SubmissionError(f"{legible(str(path.relative_to(folder)))} is {kind}, which is not accepted")
            if stat.S_ISREG(mode):
                yield path


def digest(folder: Path) -> str:
    """Return the digest of a submission: of the names and contents of all its files."""
    found = hashlib.sha256()
    for path in files(folder):
        with path.open("rb") as file:
            content = hashlib.file_digest(file, "sha256").hexdigest()
        found.update(f"{content} {path.relative_to(folder)}\n".encode(errors="surrogateescape"))
    return found.hexdigest()


def program_of(rubric: Rubric, folder: Path) -> Program:
    """Return how a submission is built and run: as it says itself, where it may."""
    own = folder / OWN
    if not (rubric.file.program.own and own.is_file()):
        return rubric.file.program
    try:
        found = msgspec.convert(tomllib.loads(own.read_text(encoding="utf-8")), Program)
        check_program(OWN, found)
    except (ValueError, msgspec.ValidationError) as error:
        raise SubmissionError(f"{OWN}: {error}") from None
    return found


def built(rubric: Rubric, place: Place, folder: Path, products: Path) -> Program:
    """Build a submission into a folder of products, which is made anew; return how it is run.

    Raises:
        SubmissionError: it cannot be built; the message ends with what the build printed.

    """
    total = sum(path.stat().st_size for path in files(folder))
    if total > rubric.file.limits.disk * 2**20:
        raise SubmissionError(f"it holds {total / 2**20:.0f} MiB, more than {rubric.file.limits.disk:g}")
    program = program_of(rubric, folder)
    shutil.rmtree(products, ignore_errors=True)
    products.mkdir(parents=True)
    if not program.build or not place.confined:
        shutil.copytree(folder, products, dirs_exist_ok=True)
    if program.build:
        inside = enclosure(rubric, place, folder, products=products)
        with tempfile.TemporaryDirectory(prefix="rayproof-") as scratch:
            ended = call(
                ["/bin/sh", "-c", program.build],
                Path(scratch),
                seconds=inside.longest,
                memory=ROOM * inside.memory,
                output=inside.disk,
                surroundings=Surroundings(enclosure=inside),
            )
        if ended.problem is not None:
            printed = f"{ended.said}\n{ended.complaint}".strip()[-MOST_PRINTED:]
            raise SubmissionError(f"its build failed: {ended.problem}\n{printed}")
    return program


def subject_of(rubric: Rubric, place: Place, program: Program, products: Path, known: str) -> Subject:
    """Return a built submission as the renderer under test; `known` is its digest.

    Raises:
        SubmissionError: its command or its answer to --capabilities is not as the protocol asks.

    """
    inside = enclosure(rubric, place, products, products=None)
    try:
        command = tuple(shlex.split(program.run))
    except ValueError as error:
        raise SubmissionError(f"its command cannot be read: {error}") from None
    subject = Subject(
        name=PROGRAM,
        title=CALLED,
        command=command,
        seconds=CALLS * WAITING * inside.seconds,
        memory=ROOM * inside.memory,
        surroundings=Surroundings(enclosure=inside),
    )
    try:
        able = rubric.believed(ask_capabilities(subject, seconds=inside.longest))
    except ValueError as error:
        raise SubmissionError(f"its answer to --capabilities: {error}") from None
    return replace(subject, capabilities=able, identity=(*command, known, repr(able), rubric.digest))


def judged(rubric: Rubric, subject: Subject, out: Path, *, resume: bool) -> RunRecord:
    """Put a submission to every case of the rubric, keep the run in a folder, and return its document.

    Raises:
        KeyboardInterrupt: it was interrupted; what was finished is kept, and taken up by `resume`.

    """
    request = RunOptions(
        selectors=(),
        out=out,
        resume=resume,
        require=(),
        jobs=1,
        timeout=120.0,
        configurations=(),
        json=None,
        subject=subject,
        patient=True,
    )
    out.mkdir(parents=True, exist_ok=True)
    planned = with_some_twice(plan(rubric.cases, (), subject), subject)
    heard, quiet, started = panel((), subject), Console(quiet=True), datetime.now(UTC)
    store = usual_store()
    store = None if store.unused is not None else store
    if store is not None:
        store.begin()
    pool = workers(subject, jobs=1, timeout=request.timeout)
    records, interrupted, stopped = render_and_judge(request, planned, heard.names, quiet, store, pool)
    if interrupted:
        raise KeyboardInterrupt
    results = results_document(planned, records, of(records), heard, [], started, subject)
    results["finished"] = stopped is None
    save_early(out, results)
    find_out(request, results, quiet, tracer=False, whole=True)
    save_results(out, results)
    return results
