"""A whole soak: rounds until enough signals were sent or the time is up, then the scenarios."""

import random
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from rayproof.reports.soak.rounds import Round
from rayproof.reports.soak.scenarios import SCENARIOS, Outcome
from rayproof.reports.soak.site import Site, Tally

PROGRAM_EVERY = 3  # rounds, in one of which another program is under test


@dataclass(frozen=True, kw_only=True)
class Request:
    """What a user asks of `rayproof soak`."""

    kills: int
    seconds: float | None
    seed: int
    jobs: int
    scenarios: bool
    cases: int  # of each run
    workers: int = 0  # of the cluster that does them; 0: none


def soaked(
    request: Request, *, tell: Callable[[str], None], keep: Callable[[Tally, list[Outcome]], None]
) -> tuple[Tally, list[Outcome]]:
    """Return what was found; `keep` gets it after each round and each scenario, as far as it is known."""
    tally, outcomes = Tally(), list[Outcome]()
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
            keep(tally, outcomes)
        for scenario in SCENARIOS if request.scenarios else ():
            outcomes.append(scenario(site))
            tell(f"{outcomes[-1].name}: {outcomes[-1].word}: {outcomes[-1].said}")
            keep(tally, outcomes)
    return tally, outcomes
