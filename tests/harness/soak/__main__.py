"""`python -m tests.harness.soak`: kill, stop and starve runs, and see that nothing is lost or left."""

import os
import random
import secrets
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TypedDict

from rayproof.reports.commands.cluster import scheduler_at
from rayproof.reports.commands.output import say, show_table, write_json
from rayproof.reports.commands.usage import UsageError, told_in_one_line, writable_folder
from rayproof.reports.processes.scratch import scratch
from tests.command_line import call
from tests.harness.soak.rounds import Round
from tests.harness.soak.site import Site, Tally

MOST_CASES = 2000  # above which a run writes no results.json
FIGURES = ("planned", "recorded", "twice", "wrong", "hung", "tracebacks", "processes_left", "folders_left")


class KillsRecord(TypedDict):
    """How often a signal hit whom, at which moment."""

    signal: str
    target: str
    moment: str
    times: int


class SoakRecord(TypedDict):
    """What `--json` writes."""

    schema: int
    seed: int
    signals: int
    kills: list[KillsRecord]
    planned: int
    recorded: int
    twice: int
    wrong: int
    hung: int
    tracebacks: int
    processes_left: int
    folders_left: int
    sentences: list[str]


def soak(
    *,
    kills: int = 200,
    seconds: float | None = None,
    seed: int | None = None,
    jobs: int | None = None,
    cases: int = 4,
    scheduler: str | None = None,
    json: Path | None = None,
) -> int:
    """Kill, stop and starve the processes of runs; show that every run, resumed, is as if nobody had.

    Parameters
    ----------
    kills
        How many signals to send in all.
    seconds
        Begin no further run after so long. Default: as long as it takes, some ten seconds a signal.
    seed
        Of the random choices; moments also depend on the machine. Default: another each time, which is printed.
    jobs
        Worker processes at once in each run. Default: the number of processors.
    cases
        Scenes of each run. One of many is disturbed again and again instead of many of few.
    scheduler
        local:N: have the runs' cases done by N workers of a Dask cluster, and hit those, too: one that each run makes
        itself, in turn with a scheduler, nannies and workers as processes of the soak. Needs rayproof[dask].
    json
        Also write the figures to this file.

    """
    if kills < 0:
        raise UsageError(f"--kills must not be negative, got {kills}")
    if seconds is not None and not seconds > 0:
        raise UsageError(f"--seconds must be positive, got {seconds} s")
    if not 1 <= cases <= MOST_CASES:
        raise UsageError(f"--cases must be from 1 to {MOST_CASES}, got {cases}")
    if scheduler is not None and not scheduler.startswith("local:"):
        raise UsageError(f"--scheduler {scheduler}: a soak kills workers, so that it takes only its own: local:N")
    place = scheduler_at(scheduler, None)
    if os.name != "posix":
        raise UsageError("a soak needs the signals of POSIX")
    if json is not None:
        with told_in_one_line():
            writable_folder(json.parent)
    seed = secrets.randbelow(2**32) if seed is None else seed
    say(f"seed {seed}")
    request = Request(
        kills=kills,
        seconds=seconds,
        seed=seed,
        jobs=jobs or os.cpu_count() or 1,
        cases=cases,
        workers=place.local if place is not None else 0,
    )
    with scratch():
        tally = soaked(request, tell=say, keep=lambda found: write_json(json, document(seed, found)))
    found = document(seed, tally)
    show_table("Signals", ("signal", "target", "moment", "times"), [tuple(one.values()) for one in found["kills"]])
    for sentence in tally.sentences:
        say(f"WRONG: {sentence}")
    say(", ".join(f"{name} {found[name]}" for name in FIGURES))
    return 0 if tally.good else 1


def document(seed: int, tally: Tally) -> SoakRecord:
    """Return what `--json` writes."""
    counts = Counter(tally.kills)
    return {
        "schema": 1,
        "seed": seed,
        "signals": len(tally.kills),
        "kills": [
            {"signal": name, "target": target, "moment": moment, "times": count}
            for (name, target, moment), count in sorted(counts.items())
        ],
        "planned": tally.planned,
        "recorded": tally.recorded,
        "twice": tally.twice,
        "wrong": tally.wrong,
        "hung": tally.hung,
        "tracebacks": tally.tracebacks,
        "processes_left": tally.processes_left,
        "folders_left": tally.folders_left,
        "sentences": tally.sentences,
    }


# A whole soak: rounds until enough signals were sent or the time is up.


PROGRAM_EVERY = 3  # rounds, in one of which another program is under test


@dataclass(frozen=True, kw_only=True)
class Request:
    """What a user asks of a soak."""

    kills: int
    seconds: float | None
    seed: int
    jobs: int
    cases: int  # of each run
    workers: int = 0  # of the cluster that does them; 0: none


def soaked(request: Request, *, tell: Callable[[str], None], keep: Callable[[Tally], None]) -> Tally:
    """Return what was found; `keep` gets it after each round, as far as it is known."""
    tally = Tally()
    rng, start = random.Random(request.seed), time.monotonic()
    with tempfile.TemporaryDirectory(prefix="rayproof-", ignore_cleanup_errors=True) as folder:
        site = Site(Path(folder), cases=request.cases, jobs=request.jobs, workers=request.workers)
        number = 0
        while len(tally.kills) < request.kills and (
            request.seconds is None or time.monotonic() - start < request.seconds
        ):
            program = number % PROGRAM_EVERY == PROGRAM_EVERY - 1
            most = request.kills - len(tally.kills)
            Round(site, rng, tally, program=program, number=number, most=most).play(tell)
            number += 1
            tell(f"{len(tally.kills)} of {request.kills} signals, {time.monotonic() - start:.0f} s")
            keep(tally)
    return tally


if __name__ == "__main__":
    sys.exit(call(soak))
