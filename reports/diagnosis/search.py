"""`search`: the smallest set of known mistakes that explains failing cases, and what was tried.

Each round screens every mistake on three of the cases that are left, puts what survives to all of them and to the
passing cases in which it would show, and takes the mistake that explains most. Where none does, mistakes with numbers
are fitted, then two are composed. A mistake that is contradicted for one kind of shape alone is named for the others.
The search ends by what is left to try, never by a clock.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import islice

import numpy as np

from rayproof.cases.stages import Stage
from rayproof.reports.diagnosis.evidence import COARSE_LIGHT, OFF_OF_ALL, OFF_OF_WRONG, Evidence, off
from rayproof.reports.judge.nearby.clouds import LIGHT
from rayproof.reports.mistakes import FAMILIES, MISTAKES, Family, Mistake, for_kinds, lights_only, together

SCREENING = 3  # failing cases that every mistake meets
LEAST_TELLING = 16  # wrong pixels that a cause explains, of all cases together whose images are not blank
MOST_CAUSES = 4
MOST_PASSING = 60  # passing cases that are asked whether they contradict a mistake
CONTRADICTED = 2  # passing cases, of which the first might be an accident of a sample
MOST_FIRST = 12  # mistakes of geometry that are composed with every mistake of light
MOST_FITTED = 2  # of these, that are composed with mistakes that have numbers; and cases to which numbers are fitted
AMONG = 12  # cases, of which those of most wrong pixels are the two
MOST_COMPOSED = 24  # compositions whose first pixels agree, and that are judged
NEWTON = 8  # steps of a fit
SLOW = 0.8  # of a score that remains after a later step: near a solution a step leaves far less
FINER = 13  # numbers that are tried between two, where pixels jump
TRIMMED = 0.7  # of the pixels, those of the smallest residuals, are fitted


@dataclass(frozen=True, kw_only=True)
class Cause:
    """A mistake and the failing cases that it explains."""

    mistake: type[Mistake]
    cases: tuple[Evidence, ...]
    alternatives: tuple[type[Mistake], ...] = ()  # that explain the same cases
    fitted: frozenset[str] = frozenset()  # cases from which its numbers come


@dataclass(kw_only=True)
class Searched:
    """What came of a search."""

    causes: list[Cause] = field(default_factory=list)
    left: list[Evidence] = field(default_factory=list)  # failing cases that none explains
    tried: int = 0  # mistakes


def ways(mistake: type[Mistake]) -> Iterator[type[Mistake]]:
    """Yield a mistake and its variants."""
    yield mistake
    yield from mistake.variants


def everyone() -> list[type[Mistake]]:
    """Return every mistake of the catalogue that has no number, and its variants."""
    return [way for name in MISTAKES for way in ways(MISTAKES[name])]


def spread(cases: Sequence[Evidence]) -> list[Evidence]:
    """Return cases so that another family comes next, and of each the ones of little work first."""
    turns: dict[str, int] = {}
    keyed = []
    for case in sorted(cases, key=lambda case: (case.work, case.case)):
        family = case.case.partition("/")[0]
        turns[family] = turns.get(family, -1) + 1
        keyed.append((turns[family], case.work, case.case, case))
    return [case for *_, case in sorted(keyed, key=lambda entry: entry[:3])]


def search(failing: Sequence[Evidence], passing: Sequence[Evidence], extra: Sequence[type[Mistake]] = ()) -> Searched:
    """Return the causes of failing cases; `extra` are mistakes that the images themselves suggest."""
    found = Searched(left=spread([case for case in failing if case.stages]))
    judge = _Judge(failing=tuple(found.left), passing=tuple(spread(passing)[:MOST_PASSING]))
    several = any(len(case.stages) > 1 for case in found.left)
    catalogue = [mistake for mistake in (*extra, *everyone()) if several or not mistake.of_several_stages]
    found.tried = len(MISTAKES) + len(FAMILIES) + len(extra)
    while found.left and len(found.causes) < MOST_CAUSES:
        cause = _next(judge, found.left, catalogue, found.causes)
        if cause is None:
            break
        found.causes.append(cause)
        explained = {case.case for case in cause.cases}
        found.left = [case for case in found.left if case.case not in explained]
    return found


def _next(
    judge: "_Judge", left: Sequence[Evidence], catalogue: Sequence[type[Mistake]], known: Sequence[Cause]
) -> Cause | None:
    """Return the cause that explains most of the cases that are left; None where there is none."""
    screen = left[:SCREENING]
    singles = [mistake for mistake in catalogue if any(case.explains(mistake) for case in screen)]
    made: tuple[Callable[[], list[type[Mistake]]], ...] = (
        lambda: singles,
        lambda: fits(sorted(left[:AMONG], key=lambda case: -np.count_nonzero(case.wrong))[:MOST_FITTED]),
        lambda: for_some_kinds(screen, catalogue),
        lambda: composed(screen, catalogue, [cause.mistake for cause in known]),
    )
    for make in made:
        cause = judge.best(make(), left)
        if cause is not None:
            return cause
    return None


@dataclass(kw_only=True)
class _Judge:
    """All cases of a run, by which mistakes are weighed."""

    failing: tuple[Evidence, ...]
    passing: tuple[Evidence, ...]
    refuted: dict[type[Mistake], bool] = field(default_factory=dict)

    def best(self, mistakes: Sequence[type[Mistake]], left: Sequence[Evidence]) -> Cause | None:
        """Return the cause that explains most of the cases that are left, with those that explain the same."""
        explained: dict[type[Mistake], tuple[Evidence, ...]] = {}
        for mistake in mistakes:
            if self.shows_where_all_is_right(mistake):
                continue
            cases = tuple(case for case in left if case.explains(mistake))
            telling = sum(int(np.count_nonzero(case.wrong)) for case in cases if not case.blank)
            if telling >= LEAST_TELLING:
                explained[mistake] = cases
        order = sorted(explained, key=lambda one: (-len(explained[one]), len(one.parts), len(one.parameters)))
        for mistake in order:
            if self.contradicted(mistake, explained[mistake], left):
                continue
            same = [
                other
                for other in order
                if other is not mistake
                and len(explained[other]) == len(explained[mistake])
                and (other.name, other.sentence) != (mistake.name, mistake.sentence)
                and not self.contradicted(other, explained[other], left)
            ]
            plain = [other for other in same if len(other.parts) <= len(mistake.parts)]
            plain = [other for other in plain if not other.parameters or mistake.parameters]
            unique = {(other.name, other.sentence): other for other in plain}
            fitted = frozenset(filter(None, (mistake.fitted_to,)))
            cases, others = explained[mistake], tuple(unique.values())
            return Cause(mistake=mistake, cases=cases, alternatives=others, fitted=fitted)
        return None

    def shows_where_all_is_right(self, mistake: type[Mistake]) -> bool:
        """Return whether a mistake would show in passing cases."""
        if mistake not in self.refuted:
            shown = islice((case for case in self.passing if case.shows(mistake)), CONTRADICTED)
            self.refuted[mistake] = len([*shown]) >= min(CONTRADICTED, max(1, len(self.passing)))
        return self.refuted[mistake]

    def contradicted(self, mistake: type[Mistake], cases: Sequence[Evidence], left: Sequence[Evidence]) -> bool:
        """Return whether a mistake would show in more failing cases than it explains."""
        explained = {case.case for case in cases}
        rest = [case for case in left if case.case not in explained]
        # What fails with another mistake's marks does not speak against this one; what fails otherwise does.
        against = sum(case.shows(mistake) for case in rest[: 2 * len(explained) + 8])
        return against > len(explained)


# Mistakes with numbers.


def fits(cases: Sequence[Evidence], onto: type[Mistake] | None = None) -> list[type[Mistake]]:
    """Return mistakes with numbers that explain one of some cases, by which the numbers are fitted.

    Put `onto` another mistake, those of light alone.
    """
    found: list[type[Mistake]] = []
    for family in (FAMILIES[name] for name in FAMILIES):
        for case in cases if onto is None or lights_only(family) else ():
            numbers = _fitted(case, family, onto)
            made = None if numbers is None else _made(family.of(numbers), onto)
            if made is not None and case.explains(made):
                made.fitted_to = case.case
                found.append(made)
                break
    return found


def _made(mistake: type[Mistake], onto: type[Mistake] | None) -> type[Mistake]:
    return mistake if onto is None else together(onto, mistake)


def _fitted(case: Evidence, family: type[Family], onto: type[Mistake] | None) -> tuple[float, ...] | None:
    """Return the numbers of a family that come nearest to a case's images, from the best starts."""

    def residuals(numbers: np.ndarray) -> np.ndarray:
        return _residuals(case, _made(family.of(numbers.tolist()), onto)())

    if family.jumps:
        return _between(residuals, family.starts[0])
    grids = np.meshgrid(*family.starts, indexing="ij")
    starts = np.stack([grid.ravel() for grid in grids], axis=1)
    apart = [_apart(residuals(start)) for start in starts]
    best, least, nearest = None, np.inf, np.inf
    for place in np.argsort(apart, kind="stable")[:2]:
        numbers, score = _newton(residuals, starts[place])
        off = _apart(residuals(numbers))
        if off < nearest:
            best, least, nearest = numbers, score, off
    if best is None or not least < 1e-2:
        return None
    rounded = np.array([_rounded(number, 1e-5) for number in best])
    return tuple((rounded if _score(residuals(rounded)) <= 2 * least + 1e-7 else best).tolist())


def _between(residuals: Callable[[np.ndarray], np.ndarray], numbers: Sequence[float]) -> tuple[float, ...]:
    """Return the number of a family whose pixels jump: the best of some, then of some between its neighbours."""
    for last in (False, True):
        apart = [_apart(residuals(np.array([number]))) for number in numbers]
        # Of equally good ones the middle one is farthest from where a pixel jumps.
        best = np.flatnonzero(np.isclose(apart, min(apart)))
        middle = float(numbers[int(best[len(best) // 2])])
        rounded = _rounded(middle, 0.05)
        if last and _apart(residuals(np.array([rounded]))) <= min(apart):
            middle = rounded
        low, high = (numbers[int(np.clip(place, 0, len(numbers) - 1))] for place in (best[0] - 1, best[-1] + 1))
        numbers = [*np.geomspace(low, high, FINER)]
    return (middle,)


def _newton(residuals: Callable[[np.ndarray], np.ndarray], start: np.ndarray) -> tuple[np.ndarray, float]:
    """Return the numbers that Gauss and Newton come to, and their score."""
    numbers = start.astype(np.float64)
    now = residuals(numbers)
    score = _score(now)
    for number in range(NEWTON):
        steps = 1e-4 * np.maximum(np.abs(numbers), 0.01)
        slopes = np.stack(
            [
                (residuals(numbers + step * axis) - now) / step
                for step, axis in zip(steps, np.eye(len(steps)), strict=True)
            ],
            axis=1,
        )
        usable = np.isfinite(now) & np.isfinite(slopes).all(axis=1)
        if np.count_nonzero(usable) < 4 * len(numbers):
            break
        size = np.abs(now)
        usable &= size <= np.quantile(size[usable], TRIMMED)
        change = np.linalg.lstsq(slopes[usable], -now[usable], rcond=None)[0]
        for share in (1.0, 0.5, 0.25, 0.05):
            tried = numbers + share * change
            after = residuals(tried)
            if _score(after) < score:
                break
        else:
            break
        done = np.all(np.abs(tried - numbers) <= 1e-12 * np.abs(tried)) or (number > 1 and _score(after) > SLOW * score)
        numbers, now, score = tried, after, _score(after)
        if done:
            break
    return numbers, score


def _residuals(case: Evidence, oracle: Mistake) -> np.ndarray:
    """Return how far an oracle's answers are from the images at the sample, relative, in stages that are wrong."""
    values, right, parts = case.sampled(oracle), case.sampled(Mistake()), []
    wrong = [stage for stage in case.stages if case.off(right, (stage,)).any()]
    for stage in wrong or case.stages:
        if stage in (Stage.OBJECT, Stage.VISIBILITY):
            continue
        own, theirs = case.own[stage], values[stage]
        with np.errstate(all="ignore"):
            size = np.linalg.norm(own, axis=1, keepdims=True)
            parts.append(np.where(size > 0, (theirs - own) / size, np.where(theirs == 0, 0.0, 10.0)).ravel())
    return np.clip(np.concatenate(parts), -10, 10) if parts else np.full(1, np.nan)


def _score(residuals: np.ndarray) -> float:
    """Return the mean of the smaller residuals; infinite where there are none."""
    known = np.sort(np.abs(residuals[np.isfinite(residuals)]))
    return float(known[: max(1, int(TRIMMED * len(known)))].mean()) if len(known) else np.inf


def _apart(residuals: np.ndarray) -> float:
    """Return the mean of all residuals, each counted as 1 at most."""
    return float(np.minimum(np.abs(np.nan_to_num(residuals, nan=1.0)), 1.0).mean())


def _rounded(number: float, within: float) -> float:
    """Return the number of the fewest digits so near to a number, relatively."""
    near = (float(f"{number:.{digits}g}") for digits in range(1, 8))
    return next((one for one in near if abs(one - number) <= within * abs(number)), number)


# For some kinds of shapes.


def for_some_kinds(cases: Sequence[Evidence], catalogue: Sequence[type[Mistake]]) -> list[type[Mistake]]:
    """Return mistakes, limited to the kinds of shapes for which cases show them, that explain one of them."""
    kinds = tuple(dict.fromkeys(kind for case in cases for kind in case.kinds))
    found: list[type[Mistake]] = []
    seen: set[tuple[object, ...]] = set()
    for case in cases:
        for mistake in catalogue:
            concerned = _concerned(case, mistake)
            if not concerned or set(concerned) == set(kinds) or (mistake, *concerned) in seen:
                continue
            seen.add((mistake, *concerned))
            some = for_kinds(mistake, concerned)
            if some is not None and case.explains(some):
                found.append(some)
    return found


def _concerned(case: Evidence, mistake: type[Mistake]) -> tuple[type, ...]:
    """Return the kinds of shapes on which most wrong pixels of a sample are as a mistake has them."""
    agree = ~case.off(case.sampled(mistake()))
    pixels, wrong = case.drawn
    objects = case.right.base.truth[Stage.OBJECT].reshape(-1, 2)[pixels, 0].astype(int)
    found = []
    for kind in case.kinds:
        here = np.array([*(isinstance(shape, kind) for shape in case.scene.shapes), False])[objects] & wrong
        if here.any() and agree[here].mean() >= 1 - OFF_OF_WRONG:
            found.append(kind)
    return tuple(found)


# Two at once.


def composed(
    cases: Sequence[Evidence], catalogue: Sequence[type[Mistake]], known: Sequence[type[Mistake]]
) -> list[type[Mistake]]:
    """Return pairs of mistakes that explain one of some cases: one of what is seen and lit, and one of light."""
    light = [
        mistake for mistake in catalogue if mistake.irradiance_of is not Mistake.irradiance_of or lights_only(mistake)
    ]
    geometry = [*known, *(mistake for mistake in catalogue if not lights_only(mistake))]
    for case in cases:
        first = _of_geometry(case, geometry)
        made: list[type[Mistake]] = []
        if case.stages[-1] in LIGHT:
            pairs = (together(one, other) for one in first for other in light if other not in (one, *one.parts))
            made = [both for both in pairs if case.agrees(both())]
            made = made or [both for one in first[:MOST_FITTED] for both in fits([case], onto=one)]
        made = made or [both for both in _products(case, light) if case.agrees(both())]
        made = made or _by_stages(case, geometry)
        found = [both for both in made[:MOST_COMPOSED] if case.explains(both)]
        if found:
            return found
    return []


def _of_geometry(case: Evidence, mistakes: Sequence[type[Mistake]]) -> list[type[Mistake]]:
    """Return the mistakes that show in a case and whose geometry is the case's, the most alike first.

    Where light alone is written, geometry shows in which pixels are dark, and in how smoothly light is off elsewhere.
    """
    asked, last = tuple(stage for stage in case.stages if stage not in LIGHT), case.stages[-1]

    def distance(mistake: type[Mistake]) -> tuple[float, float]:
        values = case.sampled(mistake())
        if not case.off_each_other(mistake(), Mistake()).any():
            return np.inf, np.inf
        if asked:
            return float(case.off(values, asked).mean()), 0.0
        own, theirs = case.own[last], values[last]
        with np.errstate(all="ignore"):
            ratio = np.log(own / theirs)
        ratio = ratio[np.isfinite(ratio)]
        spread = float(np.abs(ratio - np.median(ratio)).mean()) if len(ratio) else 0.0
        return round(float(((own > 0).any(axis=1) != (theirs > 0).any(axis=1)).mean()), 2), spread

    apart = [distance(mistake) for mistake in mistakes]
    order = sorted(range(len(apart)), key=apart.__getitem__)
    return [mistakes[place] for place in order[:MOST_FIRST] if apart[place][0] <= OFF_OF_ALL]


def _products(case: Evidence, mistakes: Sequence[type[Mistake]]) -> Iterator[type[Mistake]]:
    """Yield pairs of mistakes of light that, as factors of the right light, come to that of a case's sample."""
    stage = case.stages[-1]
    if stage not in LIGHT:
        return
    right, own = case.sampled(Mistake())[stage], case.own[stage]
    with np.errstate(all="ignore"):
        lit = (right > 0) & (own > 0)
        if not lit.any():
            return
        wanted = np.log(own[lit] / right[lit])
        logs = np.array([np.log(case.sampled(mistake())[stage][lit] / right[lit]) for mistake in mistakes])
    changing = np.flatnonzero(np.abs(np.nan_to_num(logs)).max(axis=1) > COARSE_LIGHT)
    for place, first in enumerate(changing):
        for second in changing[place + 1 :]:
            with np.errstate(invalid="ignore"):
                close = np.abs(logs[first] + logs[second] - wanted) <= 2 * COARSE_LIGHT
            if close.mean() >= 1 - OFF_OF_ALL:
                yield together(mistakes[int(first)], mistakes[int(second)])


def _by_stages(case: Evidence, mistakes: Sequence[type[Mistake]]) -> list[type[Mistake]]:
    """Return pairs of which one explains the first stage that is wrong, and both together all of a case's sample."""
    right = case.sampled(Mistake())
    wrong = [stage for stage in case.stages if case.off(right, (stage,)).mean() > OFF_OF_ALL]
    if len(wrong) < 2:
        return []
    before = case.stages[: case.stages.index(wrong[0]) + 1]
    first = [one for one in mistakes if case.off(case.sampled(one()), before).mean() <= OFF_OF_ALL][:MOST_FIRST]
    found = []
    for one in first:
        # The other one shows at the stage at which this one is wrong.
        values = case.sampled(one())
        open_stages = [stage for stage in case.stages if case.off(values, (stage,)).mean() > OFF_OF_ALL]
        for other in mistakes if open_stages else ():
            shown = off(open_stages[0], case.sampled(other())[open_stages[0]], right[open_stages[0]]).any()
            if shown and other not in (one, *one.parts) and case.agrees(together(one, other)()):
                found.append(together(one, other))
    return found
