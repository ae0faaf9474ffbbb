"""`search`: which known mistakes explain a run, screened on few cases, confirmed on all; and damaged images.

A mistake that fits some failing cases by chance does not fit the rest. So every hypothesis is judged on cases that took
no part in finding it: parameters are estimated from one half of the failing cases, and the other half is predicted.
Before any formula of physics it asks whether an image's values are right but misplaced or damaged (IMG-1).
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from rayproof.cases.stages import Stage
from rayproof.reports.diagnosis import MISTAKES
from rayproof.reports.diagnosis.answering import deviates
from rayproof.reports.diagnosis.fits import from_images
from rayproof.reports.diagnosis.hypotheses import (
    Clock,
    Hypothesis,
    bound,
    estimated,
    fits,
    in_one_light,
    joined,
    singles,
)
from rayproof.reports.diagnosis.mistakes.image import InSomeStages, Undrawn
from rayproof.reports.diagnosis.stage_by_stage import explanations
from rayproof.reports.diagnosis.trials import ALLOWED, Continued, Evidence, Tally, differ, trial

# What the camera's formulas tell of an image in which every stage is written so: then these are named, with both items.
FROM_ANOTHER_CORNER = ("stages_mirrored", "stages_upside_down", "stages_turned_half")
UNDRAWN = "undrawn"
# A name, and those of the camera's mistakes whose images differ from it in the outermost row or column alone.
RIVALS = {"one_place_off": ("one_pixel_right", "one_pixel_left", "one_pixel_down", "one_pixel_up")}
STRIPS = (1, 2, 4, 8, 16, 32, 64)  # pixels: heights of strips, widths of columns, sides of tiles
THREADS = range(2, 33)  # among so many an image is shared out in strips
LEAST_CUTS = 30  # pixels beside which, on one and the same surface, drawing ends
LEAST_LINES = 2  # borders of undrawn parts of one image, where no second image of its size foretells them


def damages(failing: Sequence[Evidence]) -> list[Hypothesis]:
    """Return every way in which images that are right may have been written, done to the stages that are wrong."""
    wrong = _wrong_stages(failing)
    written = set(failing[0].stages) if failing else set()
    found = []
    for name in MISTAKES:
        if MISTAKES[name].ways[0].stored is None or not wrong or (name in FROM_ANOTHER_CORNER and wrong == written):
            continue
        for way in MISTAKES[name].ways:
            stored = _undrawn(failing, wrong) if name == UNDRAWN else way.stored
            if stored is not None:
                there = replace(way, stored=InSomeStages(stored=stored, stages=frozenset(wrong)))
                found.append(Hypothesis(mistakes=(name,), parameters={}, way=there))
    return found


def rivals(found: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Return the camera's mistakes that may look like a damage that was found."""
    names = dict.fromkeys(rival for one in found for name in one.mistakes for rival in RIVALS.get(name, ()))
    return [Hypothesis(mistakes=(name,), parameters={}, way=way) for name in names for way in MISTAKES[name].ways]


def _wrong_stages(failing: Sequence[Evidence]) -> set[Stage]:
    """Return the stages that are wrong in more pixels than may be, in some case."""
    found: set[Stage] = set()
    for case in failing:
        for stage in case.stages:
            if stage not in found:
                off = deviates(case.right, {stage: case.ours[stage]}) & ~case.right.edge
                found |= {stage} if np.count_nonzero(off) > ALLOWED * off.size else set()
    return found


def _undrawn(failing: Sequence[Evidence], stages: set[Stage]) -> Undrawn | None:
    """Return which parts of each size of image are not drawn, by every other case of it; None where none is proven.

    An undrawn part is whole strips, columns or tiles of one number, that end amid surfaces which go on.
    """
    blank = _blank(failing[0], stages)
    if blank is None:
        return None
    by_size: dict[tuple[int, int], list[Evidence]] = {}
    for case in failing:
        by_size.setdefault(case.right.edge.shape, []).append(case)
    parts: dict[tuple[int, int], np.ndarray] = {}
    cuts, foretold = 0, False
    for (height, width), cases in by_size.items():
        shown = [(case, _holds(case, blank)) for case in cases[::2]]
        for grid in _grids(height, width):
            where = np.zeros((height, width), dtype=bool)
            for case, empty in shown:
                where |= _empty_cells(grid, empty, case.wrong)
            if all(np.count_nonzero(case.wrong & ~where) <= ALLOWED * case.wrong.size for case, _ in shown):
                parts[height, width] = where
                cuts += sum(_cuts(case, where) for case, _ in shown)
                foretold |= len(cases) > 1 or _lines(where) >= LEAST_LINES
                break
    return Undrawn(parts=parts, blank=blank) if cuts >= LEAST_CUTS and foretold else None


def _blank(case: Evidence, stages: set[Stage]) -> dict[Stage, np.ndarray] | None:
    """Return what most wrong pixels of a case hold, (channels,), for each stage; None where no number is most."""
    found = {}
    for stage in stages & set(case.stages):
        values, count = np.unique(case.ours[stage][case.wrong], axis=0, return_counts=True)
        if not len(count) or count.max() < 0.5 * count.sum():
            return None
        found[stage] = values[np.argmax(count)]
    return found


def _holds(case: Evidence, blank: dict[Stage, np.ndarray]) -> np.ndarray:
    """Return the pixels (height, width) that hold what the memory held, in every stage."""
    found = np.ones(case.wrong.shape, dtype=bool)
    for stage, value in blank.items():
        if stage in case.stages and case.ours[stage].shape[-1] == len(value):  # visibility has a channel for each light
            image = case.ours[stage]
            found &= np.all((image == value) | (np.isnan(image) & np.isnan(value)), axis=-1)
    return found


def _grids(height: int, width: int) -> Iterator[np.ndarray]:
    """Yield the number of each pixel's cell, (height, width), for each way to share out an image, coarse ones first."""
    rows, columns = np.indices((height, width))
    strips = {size for size in STRIPS if size < height}
    strips |= {size for threads in THREADS for size in (height // threads, -(-height // threads)) if size}
    for size in sorted(strips, reverse=True):
        yield rows // size
    for size in sorted((size for size in STRIPS if size < width), reverse=True):
        yield columns // size
    for size in sorted((size for size in STRIPS if 4 <= size < max(height, width)), reverse=True):
        yield rows // size * width + columns // size


def _empty_cells(grid: np.ndarray, empty: np.ndarray, wrong: np.ndarray) -> np.ndarray:
    """Return the pixels (height, width) of cells that are wrong somewhere and hold nothing."""
    drawn = np.zeros(int(grid.max()) + 1, dtype=bool)
    drawn[grid[~empty]] = True
    seen = np.zeros(len(drawn), dtype=bool)
    seen[grid[wrong]] = True
    chosen: np.ndarray = (seen & ~drawn)[grid]
    return chosen


def _cuts(case: Evidence, where: np.ndarray) -> int:
    """Return how many pixels are wrong beside a right one, across a border of what is not drawn, on one surface."""
    plain = ~case.right.edge
    wrong, good = where & case.wrong & plain, ~where & ~case.wrong & plain & _tells(case)
    down = np.count_nonzero(wrong[1:] & good[:-1]) + np.count_nonzero(wrong[:-1] & good[1:])
    along = np.count_nonzero(wrong[:, 1:] & good[:, :-1]) + np.count_nonzero(wrong[:, :-1] & good[:, 1:])
    return int(down + along)


def _tells(case: Evidence) -> np.ndarray:
    """Return the pixels (height, width) of surfaces that are lit, or that any stage before light tells of."""
    if Stage.OBJECT in case.stages or Stage.RADIANCE not in case.right.answers:
        return np.asarray(case.right.answers[Stage.OBJECT])[..., 0] >= 0
    return np.any(np.asarray(case.right.answers[Stage.RADIANCE]) > 0, axis=-1)


def _lines(where: np.ndarray) -> int:
    """Return at how many rows and columns an undrawn part begins or ends inside of the image."""
    return int(
        np.count_nonzero(np.any(where[1:] != where[:-1], axis=1))
        + np.count_nonzero(np.any(where[:, 1:] != where[:, :-1], axis=0))
    )


SCREENING = 3  # failing cases that every hypothesis meets
FAILING, PASSING = 10, 10  # cases that what is left meets
LEAST_TELLING = 30  # pixels that tell a hypothesis from the right answer and agree with it
MUTE = 1 / 3  # of the failing cases that a hypothesis explains: so many more may fail only where it says nothing
HOLDING = 10.0  # s of processor time beyond the search's: a name that is not held against every case is none
LEAST_LEFT = 8  # pixels that a mistake leaves: so many are asked whether they are another's
STILL_LEFT = 0.3  # of these so many, at most, are left by both


@dataclass(frozen=True, kw_only=True)
class Found:
    """A hypothesis that nothing contradicts."""

    hypothesis: Hypothesis
    tallies: dict[str, Tally]  # case -> what became of its pixels

    @property
    def telling(self) -> int:
        """Return how many pixels agree that tell it from the right answer."""
        return sum(tally.agree for tally in self.tallies.values())

    @property
    def off(self) -> int:
        """Return how many pixels have neither the hypothesis's value nor lie next to an edge."""
        return sum(tally.off for tally in self.tallies.values())


@dataclass(frozen=True, kw_only=True)
class Searched:
    """The result of a search: the classes of hypotheses that fit everything, and all that were tried."""

    found: tuple[Found, ...]
    tried: int  # mistakes
    failing: tuple[str, ...]  # cases looked at that failed
    fitted: tuple[str, ...]  # those that parameters were estimated from
    seconds: float
    finished: bool
    notes: tuple[str, ...] = field(default=())


def search(evidence: Sequence[Evidence], *, seconds: float = 20.0) -> Searched:
    """Return the mistakes that explain what the evidence shows, within so much processor time [s]."""
    clock = Clock(seconds)
    failed = [one for one in spread([one for one in evidence if one.failed]) if one.stages]
    failing = [one for one in failed if np.count_nonzero(one.wrong) > 0]
    passing = spread([one for one in evidence if not one.failed and one.stages])
    fitted, predicted = failing[::2], failing[1::2]
    screen = failing[:SCREENING]
    if not screen:  # what is wrong is beyond the judge's limits alone
        looks = tuple(_seen(failed))
        tried = len(MISTAKES) if looks else 0
        return Searched(found=looks, tried=tried, failing=(), fitted=(), seconds=clock.spent, finished=True)
    everything, whole = [*failing, *passing], Clock(seconds + HOLDING)
    complete = {one.case: Continued(evidence=one) for one in everything}
    staged = len(failing[0].stages) > 1 and all(one.usable for one in complete.values())
    left = _damaged(screen, failing, passing, clock, whole)
    if not left and staged:
        left = _stage_by_stage(list(complete.values()), len(failing), clock, whole)
    if not left:
        # Where a renderer's stages do not follow from each other by any mistake, as those of one that leaves out shapes
        # by bounds of its own, its image as a whole may still be one mistake's.
        rest = [*predicted, *fitted][:FAILING]
        left = _end_to_end(screen, rest, failing, passing, clock, whole)
        if staged:  # all that it wrote speaks, so that a second mistake in few pixels is seen
            left = [one for one in left if one.off < LEAST_LEFT]
    left = left or _seen(failed)
    return Searched(
        found=tuple(left),
        tried=len(MISTAKES),
        failing=tuple(one.case for one in failing),
        fitted=tuple(one.case for one in fitted),
        seconds=clock.spent,
        finished=not clock.over,
    )


def _damaged(
    screen: Sequence[Evidence], failing: Sequence[Evidence], passing: Sequence[Evidence], clock: Clock, whole: Clock
) -> list[Found]:
    """Return how right images are written wrongly; with a mistake of the camera that no case tells from that."""
    everything = [*failing, *passing]
    rest = failing[SCREENING : SCREENING + FAILING]
    left = _left(damages(failing), screen, rest, passing[:PASSING], clock)
    left += _left(rivals([one.hypothesis for one in left]), screen, rest, passing[:PASSING], clock)
    return _uncontradicted(_settled(left, everything, clock), everything, whole)


def _stage_by_stage(cases: Sequence[Continued], failing: int, clock: Clock, whole: Clock) -> list[Found]:
    """Return the mistakes that explain every stage of every case, of which the first so many fail."""
    found = []
    modes = sorted({str(case.evidence.scene.shading) for case in cases})
    for one in explanations(cases[:failing], modes, clock):
        tallies: dict[str, Tally] = {}
        for case in cases:
            tally = case.trial(one.way)
            if whole.over or (tally is not None and not tally.fits):
                break
            if tally is not None:
                tallies[case.evidence.case] = tally
        else:
            candidate = Found(hypothesis=one, tallies=tallies)
            explained = sum(case.evidence.case in tallies for case in cases[:failing])
            if candidate.telling >= LEAST_TELLING and 2 * explained >= failing and _adds_up(one, cases[:failing]):
                found.append(candidate)
    return found


def _adds_up(one: Hypothesis, cases: Sequence[Continued]) -> bool:
    """Say whether enough pixels tell two mistakes from each of them alone."""
    for alone in one.way.parts:
        agree = 0
        for case in cases:
            agree += sum(case.agreeing(one.way, alone, stage) for stage in case.stages)
            if agree >= LEAST_TELLING:
                break
        else:
            return False
    return True


def _end_to_end(
    screen: Sequence[Evidence],
    rest: Sequence[Evidence],
    failing: Sequence[Evidence],
    passing: Sequence[Evidence],
    clock: Clock,
    whole: Clock,
) -> list[Found]:
    """Return the mistakes whose answers from the camera on are the renderer's."""
    everything = [*failing, *passing]
    fitted = failing[::2][:4]
    hypotheses = list(singles(lambda fit, way: estimated(fit, way, fitted)))

    def held(some: list[Found]) -> list[Found]:
        return _uncontradicted(_settled(some, everything, clock), everything, whole)

    single = _left(hypotheses, screen, rest, passing[:PASSING], clock)
    left = held(single)
    modes = sorted({str(one.scene.shading) for one in everything})
    if not left and len(modes) > 1:
        # A mistake in one model of light may be contradicted by the other in a case that came last.
        first = {mode: [case for case in failing if case.scene.shading == mode][:1] for mode in modes}
        restricted = [
            one
            for one in in_one_light(hypotheses, modes)
            if first[str(one.way.shading)] and _fits(one, first[str(one.way.shading)]) is not None
        ]
        restricted = _left(restricted, screen, rest, passing[:PASSING], clock)
        left = held(restricted or single)
    if left and _leaves_another(left[0], everything):
        return []
    if not left and not clock.over:
        left = held(_left(fits(from_images(failing[::2]), clock), screen, rest, passing[:PASSING], clock))
    return left


def _leaves_another(one: Found, cases: Sequence[Evidence]) -> bool:
    """Say whether most pixels that a mistake leaves are those of another beside it that shows in few, as offsets do."""
    left = [case for case in cases if case.case in one.tallies and one.tallies[case.case].off]
    before = sum(one.tallies[case.case].off for case in left)
    if before < LEAST_LEFT:
        return False
    for mistake in (MISTAKES[name] for name in MISTAKES):
        for value in mistake.fit.grid if mistake.fit is not None else ():
            for way in joined(one.hypothesis.way, bound(mistake.ways[0], value)):
                tallies = [trial(case, way) for case in left]
                if sum(before if tally is None else tally.off for tally in tallies) <= before * STILL_LEFT:
                    return True
    return False


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
    hypotheses: Iterable[Hypothesis],
    screen: Sequence[Evidence],
    failing: Sequence[Evidence],
    passing: Sequence[Evidence],
    clock: Clock,
) -> list[Found]:
    """Return the hypotheses that no case contradicts and that enough pixels speak for."""
    left = []
    for one in hypotheses:
        if not clock.over and _fits(one, screen) is not None:
            left.append(one)
        else:  # nobody asks for its answers again: those of all take gigabytes
            for case in screen:
                case.forget(one.way)
    found = []
    for one in left:
        tallies = _fits(one, {case.case: case for case in (*screen, *failing, *passing)}.values())
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


def _fits(one: Hypothesis, cases: Iterable[Evidence]) -> dict[str, Tally] | None:
    """Return the tally of every case that the hypothesis has an answer to, or None at the first that contradicts it."""
    tallies = {}
    for case in cases:
        tally = trial(case, one.way)
        if tally is not None and not tally.fits:
            return None
        if tally is not None:
            tallies[case.case] = tally
    return tallies


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
    """Return the mistakes that are recognised by their look, if enough failing cases look so and none contradicts."""
    found = []
    for name in MISTAKES:
        seen = MISTAKES[name].seen
        if seen is None:
            continue
        looks = [seen(case) for case in failing]
        if False not in looks and looks.count(True) >= max(1, min(MISTAKES[name].seen_in, len(failing))):
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
