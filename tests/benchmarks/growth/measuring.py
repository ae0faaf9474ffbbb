"""One suite of a given size as a user runs it, in a process of its own: its time, its memory, its folder."""

import os
import shlex
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory

from rayproof.reports.results.document import load_results
from rayproof.reports.run.cache_store import VARIABLE
from tests.benchmarks.growth.scenes import write_scenes

# The command line, by a process that leaves what it took itself, without its children, in a file.
COMMAND = """
import resource, sys
from pathlib import Path
try:
    from {module} import main
    sys.exit(main())
finally:
    used = resource.getrusage(resource.RUSAGE_SELF)
    peak = used.ru_maxrss * (1 if sys.platform == "darwin" else 1024)
    status = Path("/proc/self/status")
    if status.is_file():  # ru_maxrss counts who started it, too
        peak = 1024 * next(int(line.split()[1]) for line in status.read_text().splitlines() if "VmHWM" in line)
    Path({told!r}).write_text(f"{{used.ru_utime + used.ru_stime}} {{peak}}")
"""
MODULE = "rayproof.reports.cli"
RESULTS, SCENES = "results", "scenes.jsonl"  # the run's own folder below its place, and what it is asked
LINE = 200  # characters of a failed run's last line
AGAIN = ("at first", "again")  # with nothing kept, and with everything


class GrowthError(RuntimeError):
    """A run did not pass, so that its time says nothing."""


@dataclass(frozen=True, kw_only=True)
class Cost:
    """What one run took; `processor_seconds` of all its processes, `parent_...` of the one that was called alone."""

    seconds: float
    processor_seconds: float
    parent_processor_seconds: float = 0.0
    peak_bytes: int  # of its largest process
    parent_peak_bytes: int = 0
    folder_bytes: int
    index_bytes: int = 0  # of the front page


@dataclass(frozen=True, kw_only=True)
class SuiteCost:
    """What a suite of so many cases took; `engine` is the scheduler that it was given, empty on this machine's pool."""

    cases: int
    when: str  # of AGAIN
    engine: str = ""
    cost: Cost


def measured(counts: Sequence[int]) -> Iterator[SuiteCost]:
    """Yield the cost of a run of each count of cases, at first and again.

    Raises:
        GrowthError: a run did not measure and pass every case.

    """
    for count in counts:
        with TemporaryDirectory(prefix="rayproof-") as folder:
            place = Path(folder)
            write_scenes(count, place / SCENES)
            for when in AGAIN:
                yield SuiteCost(cases=count, when=when, cost=_cost(place, count))


def beside_a_cluster(counts: Sequence[int], workers: int) -> Iterator[SuiteCost]:
    """Yield the cost of a run of each count of cases, at first, by as many processes and by `local:` as many workers.

    Nothing is kept, compiled kernels neither: each has a home of its own. Which goes first changes from count to count.

    Raises:
        GrowthError: a run did not measure and pass every case.

    """
    asked = {"": ("--jobs", str(workers)), f"local:{workers}": ("--scheduler", f"local:{workers}")}
    for number, count in enumerate(counts):
        for engine in list(asked) if number % 2 == 0 else list(reversed(asked)):
            with TemporaryDirectory(prefix="rayproof-") as folder:
                place = Path(folder)
                (place / "home").mkdir()
                write_scenes(count, place / SCENES)
                cost = _cost(place, count, *asked[engine], HOME=str(place / "home"))
                yield SuiteCost(cases=count, when=AGAIN[0], engine=engine, cost=cost)


def cluster_ratios(rows: Sequence[SuiteCost]) -> list[dict[str, float]]:
    """Return, for each count of cases that both did, what the cluster took over what the processes alone took.

    `parent_share` is the called process's share of the cluster's processor time, the scheduler's being its own too.
    """
    found = []
    for count in sorted({row.cases for row in rows}):
        of = {bool(row.engine): row.cost for row in rows if row.cases == count}
        if len(of) == 2:
            ours, plain = of[True], of[False]
            found.append(
                {
                    "cases": count,
                    "processor": ours.processor_seconds / plain.processor_seconds,
                    "seconds": ours.seconds / plain.seconds,
                    "parent_share": ours.parent_processor_seconds / ours.processor_seconds,
                    "parent_peak": ours.parent_peak_bytes / plain.parent_peak_bytes,
                }
            )
    return found


def _cost(place: Path, count: int, *options: str, **environment: str) -> Cost:
    """Return the cost of judging a place's scenes, every one of which must pass."""
    cost = cost_of_run([SCENES, *options], place, folder=place, environment=environment)
    passed = load_results(place / RESULTS)["summary"]["pass"]
    if passed != count:
        raise GrowthError(f"of {count} cases {passed} passed")
    return cost


def cost_of_run(
    arguments: Sequence[str],
    place: Path,
    *,
    folder: Path,
    environment: Mapping[str, str] | None = None,
    module: str = MODULE,
) -> Cost:
    """Return what one `rayproof run` takes.

    It is started in `folder` by the command line's `module`, which `environment` may say where to find. `place` gets
    its results and its cache.

    Raises:
        GrowthError: the run did not end with 0.

    """
    out, told = place / RESULTS, place / "told"
    command = COMMAND.format(module=module, told=str(told))
    variables = {**os.environ, VARIABLE: str(place / "cache"), **(environment or {})}
    start = time.perf_counter()
    with (place / "said").open("wb") as said:
        child = subprocess.Popen(
            [sys.executable, "-c", command, "run", *arguments, "--out", str(out)],
            cwd=folder,
            env=variables,
            stdin=subprocess.DEVNULL,
            stdout=said,
            stderr=said,
        )
        try:
            # Its own use of the processor and that of all workers that it waited for; its memory is the largest one's.
            _, status, used = os.wait4(child.pid, 0)
        except BaseException:
            child.terminate()
            child.wait()
            raise
    seconds = time.perf_counter() - start
    child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode != 0:
        last = (place / "said").read_text(errors="replace").strip().splitlines()[-1:]
        raise GrowthError(f"`run {shlex.join(arguments)}` ended with {child.returncode}: {''.join(last)[:LINE]}")
    processor, peak = told.read_text().split()
    return Cost(
        seconds=seconds,
        processor_seconds=used.ru_utime + used.ru_stime,
        parent_processor_seconds=float(processor),
        peak_bytes=used.ru_maxrss * (1 if sys.platform == "darwin" else 1024),
        parent_peak_bytes=int(peak),
        index_bytes=(out / "index.html").stat().st_size,
        folder_bytes=sum(path.stat().st_size for path in out.rglob("*") if path.is_file()),
    )


# What each further case costs: linear growth has the same price from one size to the next.


@dataclass(frozen=True, kw_only=True)
class Further:
    """What one case more costs, between suites of two sizes."""

    when: str
    fewer: int  # cases of the smaller suite
    more: int  # and of the larger one
    seconds: float
    processor_seconds: float
    peak_bytes: float
    folder_bytes: float


def marginal(rows: Sequence[SuiteCost]) -> list[Further]:
    """Return, for each row but the smallest of its kind, the cost of each case beyond the next smaller row's."""
    found = []
    for when in dict.fromkeys(row.when for row in rows):
        grown = sorted((row for row in rows if row.when == when), key=lambda row: row.cases)
        for small, large in pairwise(grown):
            more, one, other = large.cases - small.cases, small.cost, large.cost
            found.append(
                Further(
                    when=when,
                    fewer=small.cases,
                    more=large.cases,
                    seconds=(other.seconds - one.seconds) / more,
                    processor_seconds=(other.processor_seconds - one.processor_seconds) / more,
                    peak_bytes=(other.peak_bytes - one.peak_bytes) / more,
                    folder_bytes=(other.folder_bytes - one.folder_bytes) / more,
                )
            )
    return found
