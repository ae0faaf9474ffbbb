"""Which known mistakes explain a run: screened on few failing cases, confirmed on failing and passing ones alike.

A mistake that fits some failing cases by chance does not fit the rest. So every hypothesis is judged on cases that took
no part in finding it: parameters are estimated from one half of the failing cases, and the other half is predicted.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from rayproof.cases.stages import IMAGE_STAGES, Stage
from rayproof.reports.diagnosis import MISTAKES
from rayproof.reports.diagnosis.hypotheses import Hypothesis, in_one_light, singles, together
from rayproof.reports.diagnosis.trial import ALLOWED, Evidence, Tally, differ, trial

SCREENING = 3  # failing cases that every hypothesis meets
FAILING, PASSING = 10, 10  # cases that what is left meets
LEAST_TELLING = 30  # pixels that tell a hypothesis from the right answer and agree with it
MUTE = 1 / 3  # of the failing cases that a hypothesis explains: so many more may fail only where it says nothing
HOLDING = 10.0  # s of processor time beyond the search's: a name that is not held against every case is none
LEAST_SEEN = 3  # failing cases that look like a mistake whose pixels roundings decide
FIRST_MISTAKES = 4  # hypotheses of the first wrong stage that pairs begin with


@dataclass(frozen=True, kw_only=True)
class Found:
    """A hypothesis that nothing contradicts."""

    hypothesis: Hypothesis
    tallies: dict[str, Tally]  # case -> what became of its pixels

    @property
    def telling(self) -> int:
        """Return how many pixels agree that tell it from the right answer."""
        return sum(tally.agree for tally in self.tallies.values())


@dataclass(frozen=True, kw_only=True)
class Searched:
    """What a search came to: the classes of hypotheses that fit everything, and what was tried."""

    found: tuple[Found, ...]
    tried: int  # mistakes
    failing: tuple[str, ...]  # cases looked at that failed
    fitted: tuple[str, ...]  # those that parameters were estimated from
    seconds: float
    finished: bool
    notes: tuple[str, ...] = field(default=())


class Clock:
    """Processor time [s] that is left for looking."""

    def __init__(self, seconds: float) -> None:
        self._start, self._most = time.process_time(), seconds

    @property
    def spent(self) -> float:
        """Return what is spent [s]."""
        return time.process_time() - self._start

    @property
    def over(self) -> bool:
        """Say whether nothing is left."""
        return self.spent > self._most


def search(evidence: Sequence[Evidence], *, seconds: float = 20.0, pairs: bool = True) -> Searched:
    """Return the mistakes that explain what the evidence shows, within so much processor time [s]."""
    clock = Clock(seconds)
    failing = spread([one for one in evidence if one.failed])
    failing = [one for one in failing if one.stages and np.count_nonzero(one.wrong) > 0]
    passing = spread([one for one in evidence if not one.failed and one.stages])
    fitted, predicted = failing[::2], failing[1::2]
    screen = failing[:SCREENING]
    if not screen:
        return Searched(found=(), tried=0, failing=(), fitted=(), seconds=clock.spent, finished=True)
    hypotheses = list(singles(fitted[:4]))
    rest = [*predicted, *fitted][:FAILING]
    everything, whole = [*failing, *passing], Clock(seconds + HOLDING)

    def held(some: list[Found]) -> list[Found]:
        return _uncontradicted(_settled(some, everything, clock), everything, whole)

    single = _left(hypotheses, screen, rest, passing[:PASSING], clock)
    left = held(single)
    modes = sorted({str(one.scene.shading) for one in everything})
    if not left and len(modes) > 1:
        # A mistake in one model of light may be contradicted by the other in a case that came last.
        single = _left(in_one_light(hypotheses, failing, modes), screen, rest, passing[:PASSING], clock) or single
        left = held(single)
    if not single and pairs and len(screen[0].stages) > 1:
        left = held(_pairs(hypotheses, screen, rest, passing[:PASSING], clock))
    left = left or _seen(failing)
    return Searched(
        found=tuple(left),
        tried=len({name for one in hypotheses for name in one.mistakes}),
        failing=tuple(one.case for one in failing),
        fitted=tuple(one.case for one in fitted),
        seconds=clock.spent,
        finished=not clock.over,
    )


def spread(evidence: Sequence[Evidence]) -> list[Evidence]:
    """Return the evidence with one case of each family first, then the next of each, and so on."""
    seen: dict[str, int] = {}
    places = []
    for one in evidence:
        family = one.case.split("/")[0]
        seen[family] = seen.get(family, -1) + 1
        places.append(seen[family])
    order = sorted(range(len(evidence)), key=lambda index: (places[index], index))
    return [evidence[index] for index in order]


def _left(
    hypotheses: Sequence[Hypothesis],
    screen: Sequence[Evidence],
    failing: Sequence[Evidence],
    passing: Sequence[Evidence],
    clock: Clock,
) -> list[Found]:
    """Return the hypotheses that no case contradicts and that enough pixels speak for."""
    left = [one for one in hypotheses if not clock.over and _fits(one, screen, {}) is not None]
    found = []
    for one in left:
        tallies = _fits(one, [*screen, *failing, *passing], {})
        if tallies is None or clock.over:
            continue
        candidate = Found(hypothesis=one, tallies=tallies)
        seen = [case for case in {case.case: case for case in (*screen, *failing)}.values() if case.case in tallies]
        explained = [case for case in seen if tallies[case.case].explains]
        # A failure of few pixels, such as a feeler that grazes a face, speaks for nothing and against nothing; so does
        # one whose pixels all lie where under the hypothesis rounding decides. That may be so in few cases.
        mute = [case for case in seen if not tallies[case.case].explains and not negligible(case)]
        if (
            candidate.telling >= LEAST_TELLING
            and 2 * len(explained) >= len(seen)
            and len(mute) <= MUTE * len(explained)
        ):
            found.append(candidate)
    return found


def negligible(case: Evidence) -> bool:
    """Say whether a renderer fails a case by no more pixels than may be off under a hypothesis."""
    return bool(np.count_nonzero(case.wrong) <= ALLOWED * case.wrong.size)


def _fits(one: Hypothesis, cases: Sequence[Evidence], known: dict[str, Tally]) -> dict[str, Tally] | None:
    """Return the tally of every case that the hypothesis has an answer to, or None at the first that contradicts it."""
    for case in cases:
        if case.case in known:
            continue
        tally = trial(case, one.way)
        if tally is None:
            continue
        if not tally.fits:
            return None
        known[case.case] = tally
    return known


def _pairs(
    hypotheses: Sequence[Hypothesis],
    screen: Sequence[Evidence],
    failing: Sequence[Evidence],
    passing: Sequence[Evidence],
    clock: Clock,
) -> list[Found]:
    """Return pairs: a mistake that explains the first wrong stage by itself, and another beside it."""
    shown = [one for one in [*screen, *failing] if one.first_wrong is not None][:SCREENING]
    firsts: list[Hypothesis] = []
    for one in hypotheses:
        if clock.over:
            return []
        tallies = [(trial(case, one.way, _upto(case.first_wrong)), case) for case in shown]
        told = [tally for tally, _ in tallies if tally is not None]
        if told and all(tally.fits for tally in told) and any(tally.explains for tally in told):
            firsts.append(one)
    for first in firsts[:FIRST_MISTAKES]:
        both = [pair for one in hypotheses if (pair := together(first, one)) is not None]
        left = _left(both, screen, failing, passing, clock)
        if left or clock.over:
            return left
    return []


def _upto(last: Stage | None) -> tuple[Stage, ...]:
    return IMAGE_STAGES if last is None else IMAGE_STAGES[: IMAGE_STAGES.index(last) + 1]


def _settled(left: list[Found], cases: Sequence[Evidence], clock: Clock) -> list[Found]:
    """Return those that are left when every case that tells two of them apart has spoken."""
    index = 0
    while index < len(cases) and len(left) > 1 and not clock.over:
        case = cases[index]
        index += 1
        if all(case.case in one.tallies for one in left):
            continue
        if not any(differ(case, left[0].hypothesis.way, one.hypothesis.way) for one in left[1:]):
            continue
        kept = []
        for one in left:
            tally = trial(case, one.hypothesis.way)
            if tally is None or tally.fits:
                tallies = one.tallies if tally is None else {**one.tallies, case.case: tally}
                kept.append(Found(hypothesis=one.hypothesis, tallies=tallies))
        left = kept
    return left


def _uncontradicted(left: list[Found], cases: Sequence[Evidence], clock: Clock) -> list[Found]:
    """Return those that no case contradicts of all there are; none where there is no time to ask all.

    A mistake that nobody knows may look like a known one in most cases.
    """
    for case in cases:
        if clock.over:
            return []
        kept = []
        for one in left:
            tally = one.tallies.get(case.case) or trial(case, one.hypothesis.way)
            if tally is None or tally.fits:
                tallies = one.tallies if tally is None else {**one.tallies, case.case: tally}
                kept.append(Found(hypothesis=one.hypothesis, tallies=tallies))
        left = kept
    return left


def _seen(failing: Sequence[Evidence]) -> list[Found]:
    """Return the mistakes that are told by how they look, where a few failing cases look so and none contradicts."""
    found = []
    for name in MISTAKES:
        seen = MISTAKES[name].seen
        if seen is None:
            continue
        looks = [seen(case) for case in failing]
        if False not in looks and looks.count(True) >= min(LEAST_SEEN, len(failing)):
            one = Hypothesis(mistakes=(name,), parameters={}, way=MISTAKES[name].ways[0])
            found.append(Found(hypothesis=one, tallies={}))
    return found


def apart(found: Sequence[Found], cases: Sequence[Evidence]) -> Callable[[Found, Found], str | None]:
    """Return the function that names the first case, of those given, in which two hypotheses answer differently."""
    assert found

    def told(one: Found, other: Found) -> str | None:
        ways = one.hypothesis.way, other.hypothesis.way
        return next((case.case for case in cases if differ(case, *ways)), None)

    return told
