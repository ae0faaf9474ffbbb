"""The default suite of two checkouts side by side: what a change of the code costs, as ratios of processor time.

Both are run from nothing and run again in every round, and which goes first changes from round to round, since what
disturbs one run disturbs its neighbour too (Chen and Revels, "Robust benchmarking in noisy environments", 2016).
"""

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from rayproof.reports.studies.compare.statistics import LEVEL, median_interval
from tests.benchmarks.growth.measuring import AGAIN, MODULE, Cost, cost_of_run

HERE, AGAINST = "here", "against"
CHECKOUT = Path(__file__).resolve().parents[3]
ENTRY = Path("reports") / "cli.py"
OLDER = "reports.cli"


@dataclass(frozen=True, kw_only=True)
class Round:
    """What one checkout's suite cost in one round."""

    number: int
    checkout: str  # HERE or AGAINST
    when: str  # "at first", with a fresh home and nothing kept; or "again"
    cost: Cost


@dataclass(frozen=True)
class Ratio:
    """This checkout's processor time over the other's: the median of `rounds` quotients and its interval."""

    ratio: float
    interval: tuple[float, float]
    rounds: int


def check(against: Path, rounds: int) -> None:
    """Raise ValueError if `against` is no checkout of rayproof, or the number of rounds has no middle value."""
    if rounds < 1 or rounds % 2 == 0:
        raise ValueError(f"--rounds must be odd, got {rounds}")
    if not (against / ENTRY).is_file():
        raise ValueError(f"{against} is no checkout of rayproof: it has no {ENTRY}")


def compared(against: Path, selectors: Sequence[str], *, rounds: int) -> Iterator[Round]:
    """Yield what the suite costs in this checkout and in the one `against`, round by round.

    Both run in this Python environment, each with its own code. `selectors` restrict the suite.

    Raises:
        GrowthError: a run did not end with 0, so that its time says nothing.

    """
    places = {HERE: CHECKOUT, AGAINST: against.resolve()}
    for number in range(rounds):
        order = list(places) if number % 2 == 0 else list(reversed(places))
        with TemporaryDirectory(prefix="rayproof-") as folder:
            for when in AGAIN:
                for checkout in order:
                    cost = _suite(places[checkout], Path(folder) / checkout, selectors)
                    yield Round(number=number, checkout=checkout, when=when, cost=cost)


def _suite(checkout: Path, place: Path, selectors: Sequence[str]) -> Cost:
    home = place / "home"  # Dr.Jit keeps its compiled kernels there
    home.mkdir(parents=True, exist_ok=True)
    # Until version 0.2 the four packages were modules of their own, at the top of the checkout.
    holder, module = (checkout / "python", MODULE) if (checkout / "python").is_dir() else (checkout, OLDER)
    path = os.pathsep.join([str(holder), *filter(None, [os.environ.get("PYTHONPATH")])])
    variables = {"HOME": str(home), "PYTHONPATH": path}
    return cost_of_run(selectors, place, folder=checkout, environment=variables, module=module)


def ratios(rounds: Sequence[Round]) -> dict[str, Ratio]:
    """Return, at first and again, this checkout's processor time over the other's: median, interval, rounds."""
    times = {(one.number, one.checkout, one.when): one.cost.processor_seconds for one in rounds}
    result: dict[str, Ratio] = {}
    for when in AGAIN:
        numbers = [n for n in range(len(rounds)) if (n, HERE, when) in times and (n, AGAINST, when) in times]
        quotients = [times[n, HERE, when] / times[n, AGAINST, when] for n in numbers]
        # An interrupted comparison may have an even number of rounds: the last one is left out.
        odd = quotients[: len(quotients) - (len(quotients) + 1) % 2]
        if odd:
            result[when] = Ratio(float(np.median(odd)), median_interval(odd, level=LEVEL), len(odd))
    return result
