"""`search`: find the smallest set of known mistakes that explains failing cases.

Each round screens every mistake on three of the unexplained cases, compares the remaining mistakes with all unexplained
cases and with the passing cases, and takes the mistake that explains most cases. If there is none, the parameters of
families of mistakes are fitted, then mistakes are limited to some kinds of shapes, then two mistakes are combined.
The search ends when all of this was tried; it has no time limit.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import islice

import numpy as np

from rayproof.cases.stages import Stage
from rayproof.reports.diagnosis.evidence import COARSE_LIGHT, OFF_OF_ALL, OFF_OF_WRONG, Evidence, off
from rayproof.reports.judge.nearby.clouds import LIGHT
from rayproof.reports.mistakes import FAMILIES, MISTAKES, Family, Mistake, for_kinds, lights_only, together

SCREENING = 3  # failing cases with which every mistake is compared
LEAST_TELLING = 16  # wrong pixels that a cause must explain, in all cases whose images are not blank
MOST_CAUSES = 4
MOST_PASSING = 60  # passing cases that may contradict a mistake
CONTRADICTED = 2  # passing cases that contradict a mistake; a single one might be an accident of its sample
MOST_FIRST = 12  # mistakes of geometry that are combined with every mistake of light
MOST_FITTED = 2  # mistakes of geometry that are combined with families; also cases to which parameters are fitted
AMONG = 12  # unexplained cases from which the cases for a fit are chosen, by their number of wrong pixels
MOST_COMPOSED = 24  # combinations that agree with a sample and are judged
NEWTON = 8  # steps of a fit
SLOW = 0.8  # a fit ends if a later step leaves more than this share of the score; near a solution it leaves far less
FINER = 13  # values that are tried between two values if pixels jump
TRIMMED = 0.7  # share of the pixels that are fitted, those with the smallest residuals


@dataclass(frozen=True, kw_only=True)
class Cause:
    """A mistake and the failing cases that it explains."""

    mistake: type[Mistake]
    cases: tuple[Evidence, ...]
    alternatives: tuple[type[Mistake], ...] = ()  # mistakes that explain the same cases
    fitted: frozenset[str] = frozenset()  # cases to which its parameters were fitted


@dataclass(kw_only=True)
class Searched:
    """The result of a search."""

    causes: list[Cause] = field(default_factory=list)
    left: list[Evidence] = field(default_factory=list)  # unexplained failing cases
    tried: int = 0  # number of mistakes


def ways(mistake: type[Mistake]) -> Iterator[type[Mistake]]:
    """Yield a mistake and its variants."""
    yield mistake
    yield from mistake.variants


def everyone() -> list[type[Mistake]]:
    """Return every mistake without parameters, and its variants."""
    return [way for name in MISTAKES for way in ways(MISTAKES[name])]


def spread(cases: Sequence[Evidence]) -> list[Evidence]:
    """Return the cases with families in turn, and those with the least work first within each family."""
    turns: dict[str, int] = {}
    keyed = []
    for case in sorted(cases, key=lambda case: (case.work, case.case)):
        family = case.case.partition("/")[0]
        turns[family] = turns.get(family, -1) + 1
        keyed.append((turns[family], case.work, case.case, case))
    return [case for *_, case in sorted(keyed, key=lambda entry: entry[:3])]


def search(failing: Sequence[Evidence], passing: Sequence[Evidence], extra: Sequence[type[Mistake]] = ()) -> Searched:
    """Return the causes of failing cases; `extra` are further mistakes that the images suggest."""
    searched = Searched(left=spread([case for case in failing if case.stages]))
    judge = _Judge(failing=tuple(searched.left), passing=tuple(spread(passing)[:MOST_PASSING]))
    several = any(len(case.stages) > 1 for case in searched.left)
    catalogue = [mistake for mistake in (*extra, *everyone()) if several or not mistake.of_several_stages]
    searched.tried = len(MISTAKES) + len(FAMILIES) + len(extra)
    while searched.left and len(searched.causes) < MOST_CAUSES:
        cause = _next(judge, searched.left, catalogue, searched.causes)
        if cause is None:
            break
        searched.causes.append(cause)
        explained = {case.case for case in cause.cases}
        searched.left = [case for case in searched.left if case.case not in explained]
    return searched


def _next(
    judge: "_Judge", left: Sequence[Evidence], catalogue: Sequence[type[Mistake]], causes: Sequence[Cause]
) -> Cause | None:
    """Return the cause that explains the most of the unexplained cases, or None."""
    screen = left[:SCREENING]
    singles = [mistake for mistake in catalogue if any(case.explains(mistake) for case in screen)]
    made: tuple[Callable[[], list[type[Mistake]]], ...] = (
        lambda: singles,
        lambda: fits(sorted(left[:AMONG], key=lambda case: -np.count_nonzero(case.wrong))[:MOST_FITTED]),
        lambda: for_some_kinds(screen, catalogue),
        lambda: composed(screen, catalogue, [cause.mistake for cause in causes]),
    )
    for make in made:
        cause = judge.best(make(), left)
        if cause is not None:
            return cause
    return None


@dataclass(kw_only=True)
class _Judge:
    """The cases of a run, with which mistakes are compared."""

    failing: tuple[Evidence, ...]
    passing: tuple[Evidence, ...]
    refuted: dict[type[Mistake], bool] = field(default_factory=dict)

    def best(self, mistakes: Sequence[type[Mistake]], left: Sequence[Evidence]) -> Cause | None:
        """Return the cause that explains the most of the unexplained cases, with its alternatives, or None."""
        explained: dict[type[Mistake], tuple[Evidence, ...]] = {}
        for mistake in mistakes:
            if self.shows_where_all_is_right(mistake):
                continue
            cases = tuple(case for case in left if case.explains(mistake))
            telling = sum(int(np.count_nonzero(case.wrong)) for case in cases if not case.blank)
            if telling >= LEAST_TELLING:
                explained[mistake] = cases
        order = sorted(
            explained,
            key=lambda candidate: (-len(explained[candidate]), len(candidate.parts), len(candidate.parameters)),
        )
        for mistake in order:
            if self.contradicted(mistake, explained[mistake], left):
                continue
            same = [
                candidate
                for candidate in order
                if candidate is not mistake
                and len(explained[candidate]) == len(explained[mistake])
                and (candidate.name, candidate.sentence) != (mistake.name, mistake.sentence)
                and not self.contradicted(candidate, explained[candidate], left)
            ]
            plain = [candidate for candidate in same if len(candidate.parts) <= len(mistake.parts)]
            plain = [candidate for candidate in plain if not candidate.parameters or mistake.parameters]
            unique = {(candidate.name, candidate.sentence): candidate for candidate in plain}
            fitted = frozenset(filter(None, (mistake.fitted_to,)))
            cases, others = explained[mistake], tuple(unique.values())
            return Cause(mistake=mistake, cases=cases, alternatives=others, fitted=fitted)
        return None

    def shows_where_all_is_right(self, mistake: type[Mistake]) -> bool:
        """Return whether a mistake would be visible in passing cases."""
        if mistake not in self.refuted:
            shown = islice((case for case in self.passing if case.shows(mistake)), CONTRADICTED)
            self.refuted[mistake] = len([*shown]) >= min(CONTRADICTED, max(1, len(self.passing)))
        return self.refuted[mistake]

    def contradicted(self, mistake: type[Mistake], cases: Sequence[Evidence], left: Sequence[Evidence]) -> bool:
        """Return whether a mistake would be visible in more of the other failing cases than it explains."""
        explained = {case.case for case in cases}
        rest = [case for case in left if case.case not in explained]
        # A case that fails by another mistake does not contradict this one, unless this one would be visible there.
        against = sum(case.shows(mistake) for case in rest[: 2 * len(explained) + 8])
        return against > len(explained)


# Families of mistakes.


def fits(cases: Sequence[Evidence], onto: type[Mistake] | None = None) -> list[type[Mistake]]:
    """Return mistakes of families that each explain a case, to which their parameters are fitted.

    They are combined with the mistake `onto`, if it is given; then only families of light are fitted.
    """
    explaining: list[type[Mistake]] = []
    for family in (FAMILIES[name] for name in FAMILIES):
        for case in cases if onto is None or lights_only(family) else ():
            numbers = _fitted(case, family, onto)
            made = None if numbers is None else _made(family.of(numbers), onto)
            if made is not None and case.explains(made):
                made.fitted_to = case.case
                explaining.append(made)
                break
    return explaining


def _made(mistake: type[Mistake], onto: type[Mistake] | None) -> type[Mistake]:
    return mistake if onto is None else together(onto, mistake)


def _fitted(case: Evidence, family: type[Family], onto: type[Mistake] | None) -> tuple[float, ...] | None:
    """Return the parameters of a family that fit a case's images best, from the two best starts; None without a fit."""

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
    """Return the parameter of a family whose pixels jump: the best value, refined once between its neighbours."""
    for last in (False, True):
        apart = [_apart(residuals(np.array([number]))) for number in numbers]
        # The middle one of equally good values is farthest from a jump of a pixel.
        best = np.flatnonzero(np.isclose(apart, min(apart)))
        middle = float(numbers[int(best[len(best) // 2])])
        rounded = _rounded(middle, 0.05)
        if last and _apart(residuals(np.array([rounded]))) <= min(apart):
            middle = rounded
        low, high = (numbers[int(np.clip(place, 0, len(numbers) - 1))] for place in (best[0] - 1, best[-1] + 1))
        numbers = [*np.geomspace(low, high, FINER)]
    return (middle,)


def _newton(residuals: Callable[[np.ndarray], np.ndarray], start: np.ndarray) -> tuple[np.ndarray, float]:
    """Return the parameters from the Gauss-Newton method, and their score."""
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
    """Return the relative differences between an oracle and the images at the sample, in the wrong stages."""
    values, right, parts = case.sampled(oracle), case.sampled(Mistake()), []
    wrong = [stage for stage in case.stages if case.off(right, (stage,)).any()]
    for stage in wrong or case.stages:
        if stage in (Stage.OBJECT, Stage.VISIBILITY):
            continue
        own, computed = case.own[stage], values[stage]
        with np.errstate(all="ignore"):
            size = np.linalg.norm(own, axis=1, keepdims=True)
            parts.append(np.where(size > 0, (computed - own) / size, np.where(computed == 0, 0.0, 10.0)).ravel())
    return np.clip(np.concatenate(parts), -10, 10) if parts else np.full(1, np.nan)


def _score(residuals: np.ndarray) -> float:
    """Return the mean of the smallest 70 % of the residuals' magnitudes; inf if none is finite."""
    sizes = np.sort(np.abs(residuals[np.isfinite(residuals)]))
    return float(sizes[: max(1, int(TRIMMED * len(sizes)))].mean()) if len(sizes) else np.inf


def _apart(residuals: np.ndarray) -> float:
    """Return the mean magnitude of all residuals, each limited to 1."""
    return float(np.minimum(np.abs(np.nan_to_num(residuals, nan=1.0)), 1.0).mean())


def _rounded(number: float, within: float) -> float:
    """Return the number with the fewest digits whose relative difference from `number` is at most `within`."""
    near = (float(f"{number:.{digits}g}") for digits in range(1, 8))
    return next((candidate for candidate in near if abs(candidate - number) <= within * abs(number)), number)


# For some kinds of shapes.


def for_some_kinds(cases: Sequence[Evidence], catalogue: Sequence[type[Mistake]]) -> list[type[Mistake]]:
    """Return mistakes that explain a case if they are limited to the kinds of shapes whose pixels agree with them."""
    kinds = tuple(dict.fromkeys(kind for case in cases for kind in case.kinds))
    explaining: list[type[Mistake]] = []
    tried: set[tuple[object, ...]] = set()
    for case in cases:
        for mistake in catalogue:
            concerned = _concerned(case, mistake)
            if not concerned or set(concerned) == set(kinds) or (mistake, *concerned) in tried:
                continue
            tried.add((mistake, *concerned))
            limited = for_kinds(mistake, concerned)
            if limited is not None and case.explains(limited):
                explaining.append(limited)
    return explaining


def _concerned(case: Evidence, mistake: type[Mistake]) -> tuple[type, ...]:
    """Return the kinds of shapes whose wrong pixels in a sample mostly agree with a mistake."""
    agree = ~case.off(case.sampled(mistake()))
    pixels, wrong = case.drawn
    objects = case.right.base.truth[Stage.OBJECT].reshape(-1, 2)[pixels, 0].astype(int)
    concerned = []
    for kind in case.kinds:
        here = np.array([*(isinstance(shape, kind) for shape in case.scene.shapes), False])[objects] & wrong
        if here.any() and agree[here].mean() >= 1 - OFF_OF_WRONG:
            concerned.append(kind)
    return tuple(concerned)


# Two mistakes at once.


def composed(
    cases: Sequence[Evidence], catalogue: Sequence[type[Mistake]], named: Sequence[type[Mistake]]
) -> list[type[Mistake]]:
    """Return pairs of mistakes that explain one of the cases: of geometry and light, two of light, or of two stages."""
    light = [
        mistake for mistake in catalogue if mistake.irradiance_of is not Mistake.irradiance_of or lights_only(mistake)
    ]
    geometry = [*named, *(mistake for mistake in catalogue if not lights_only(mistake))]
    for case in cases:
        first = _of_geometry(case, geometry)
        made: list[type[Mistake]] = []
        if case.stages[-1] in LIGHT:
            pairs = (
                together(base, addition) for base in first for addition in light if addition not in (base, *base.parts)
            )
            made = [pair for pair in pairs if case.agrees(pair())]
            made = made or [pair for base in first[:MOST_FITTED] for pair in fits([case], onto=base)]
        made = made or [pair for pair in _products(case, light) if case.agrees(pair())]
        made = made or _by_stages(case, geometry)
        explaining = [pair for pair in made[:MOST_COMPOSED] if case.explains(pair)]
        if explaining:
            return explaining
    return []


def _of_geometry(case: Evidence, mistakes: Sequence[type[Mistake]]) -> list[type[Mistake]]:
    """Return the mistakes that are visible in a case and agree with its geometry, the best first.

    If the images contain only light, the geometry is compared by the dark pixels, and by the spread of the logarithmic
    error of the others.
    """
    before_light, last = tuple(stage for stage in case.stages if stage not in LIGHT), case.stages[-1]

    def distance(mistake: type[Mistake]) -> tuple[float, float]:
        values = case.sampled(mistake())
        if not case.off_each_other(mistake(), Mistake()).any():
            return np.inf, np.inf
        if before_light:
            return float(case.off(values, before_light).mean()), 0.0
        own, computed = case.own[last], values[last]
        with np.errstate(all="ignore"):
            ratio = np.log(own / computed)
        ratio = ratio[np.isfinite(ratio)]
        spread = float(np.abs(ratio - np.median(ratio)).mean()) if len(ratio) else 0.0
        return round(float(((own > 0).any(axis=1) != (computed > 0).any(axis=1)).mean()), 2), spread

    apart = [distance(mistake) for mistake in mistakes]
    order = sorted(range(len(apart)), key=apart.__getitem__)
    return [mistakes[place] for place in order[:MOST_FIRST] if apart[place][0] <= OFF_OF_ALL]


def _products(case: Evidence, mistakes: Sequence[type[Mistake]]) -> Iterator[type[Mistake]]:
    """Yield pairs of mistakes of light whose factors multiply to the ratio of the case's light to the right one."""
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
    """Return pairs that agree with a case's sample, whose first mistake agrees up to the first wrong stage."""
    right = case.sampled(Mistake())
    wrong = [stage for stage in case.stages if case.off(right, (stage,)).mean() > OFF_OF_ALL]
    if len(wrong) < 2:
        return []
    before = case.stages[: case.stages.index(wrong[0]) + 1]
    first = [base for base in mistakes if case.off(case.sampled(base()), before).mean() <= OFF_OF_ALL][:MOST_FIRST]
    pairs = []
    for base in first:
        # The second mistake must change the first stage where the first mistake does not agree.
        values = case.sampled(base())
        open_stages = [stage for stage in case.stages if case.off(values, (stage,)).mean() > OFF_OF_ALL]
        for addition in mistakes if open_stages else ():
            shown = off(open_stages[0], case.sampled(addition())[open_stages[0]], right[open_stages[0]]).any()
            if shown and addition not in (base, *base.parts) and case.agrees(together(base, addition)()):
                pairs.append(together(base, addition))
    return pairs
