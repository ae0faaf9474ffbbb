"""`Hypothesis`: a mistake as one way of a renderer, its parameter estimated (`sought`, `middle`); pairs; `Clock`."""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage
from rayproof.reports.diagnosis import MISTAKES, Fit, Way, Wrong
from rayproof.reports.diagnosis.trials import Evidence, trial
from rayproof.reports.judge.nearby.clouds import LIGHT

if TYPE_CHECKING:
    from rayproof.reports.diagnosis.fits import Fitting


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


LEAST_SAMPLES = 30  # pixels that an estimate needs
SPREAD = 1e-3  # relative: half of the samples lie so near to the estimate, or there is no such parameter
SECTIONS = 24  # halvings of the golden section between two values of a grid


@dataclass(frozen=True, kw_only=True)
class Hypothesis:
    """One or two mistakes, each with its parameter, answering in one way."""

    mistakes: tuple[str, ...]
    parameters: Mapping[str, float]
    way: Way

    @property
    def sentence(self) -> str:
        """Return what the renderer does, as a verb phrase."""
        return " and ".join(map(self.phrase, self.mistakes))

    def phrase(self, name: str) -> str:
        """Return one of its mistakes as a verb phrase, with the model of light that it is restricted to."""
        where = f", in scenes of {self.way.shading} light alone" if self.way.shading is not None else ""
        if self.way.says is not None:
            return self.way.says + where
        return MISTAKES[name].sentence(self.parameters.get(name, 0.0)) + where

    @property
    def items(self) -> tuple[str, ...]:
        """Return the specification items that the mistakes concern."""
        return tuple(dict.fromkeys(item for name in self.mistakes for item in MISTAKES[name].items))


Estimate = Callable[[Fit, Way], float | None]


def singles(estimate: Estimate) -> Iterator[Hypothesis]:
    """Yield every mistake in each of its ways; those with a parameter as it is estimated, where it is."""
    for name in MISTAKES:
        mistake = MISTAKES[name]
        if mistake.seen is not None or mistake.fitted is not None or mistake.ways[0].stored is not None:
            continue
        parameters = {}
        if mistake.fit is not None:
            parameter = estimate(mistake.fit, mistake.ways[0])
            if parameter is None:
                continue
            parameters = {name: parameter}
        for way in mistake.ways:
            yield Hypothesis(mistakes=(name,), parameters=parameters, way=bound(way, parameters.get(name, 0.0)))


def fits(cases: "Sequence[Fitting]", clock: Clock) -> Iterator[Hypothesis]:
    """Yield what the mistakes that are fitted make of some failing cases, while there is time."""
    for name in MISTAKES:
        fitted = MISTAKES[name].fitted
        if fitted is None or clock.over:
            continue
        with np.errstate(all="ignore"):
            for way in fitted(cases):
                if clock.over:
                    break
                yield Hypothesis(mistakes=(name,), parameters={}, way=way)


def in_one_light(hypotheses: Sequence[Hypothesis], modes: Sequence[str]) -> list[Hypothesis]:
    """Return the hypotheses about light alone, each restricted to one of several models of light.

    A renderer that computes the models apart may be wrong in one of them.
    """
    about_light = [one for one in hypotheses if one.way.stages and set(one.way.stages) <= set(LIGHT)]
    about_light = [one for one in about_light if one.way.asked is None and len(modes) > 1]
    return [replace(one, way=replace(one.way, shading=mode)) for mode in modes for one in about_light]


def bound(way: Way, parameter: float) -> Way:
    """Return a way whose stages are computed with a parameter."""
    if not parameter:
        return way

    def with_it(wrong: Wrong) -> Wrong:
        own = getattr(wrong, "at", None)
        return own(parameter) if own is not None else lambda given: wrong(replace(given, parameter=parameter))

    return replace(way, stages={stage: with_it(wrong) for stage, wrong in way.stages.items()})


def estimated(fit: Fit, way: Way, evidence: Sequence[Evidence]) -> float | None:
    """Return a parameter's estimate; None where there is little to go by, or the pixels do not agree."""
    if fit.grid:
        return _sought_end_to_end(fit, way, evidence)
    found = [
        fit.samples(one.scene, {stage: np.asarray(image) for stage, image in one.right.answers.items()}, dict(one.ours))
        for one in evidence
        if one.scene.lights and (Stage.RADIANCE in one.stages)
    ]
    return middle(found, fit.nothing)


def middle(found: Sequence[np.ndarray], nothing: float) -> float | None:
    """Return the middle sample of all; None where there are few, they do not agree, or they say `nothing`."""
    samples = np.concatenate(found) if found else np.zeros(0)
    if len(samples) < LEAST_SAMPLES:
        return None
    value = float(np.median(samples))
    near = abs(value) > SPREAD and np.median(np.abs(samples - value)) <= SPREAD * abs(value)
    return value if near and abs(value - nothing) > SPREAD else None


def _sought_end_to_end(fit: Fit, way: Way, evidence: Sequence[Evidence]) -> float | None:
    shown = [one for one in evidence if one.scene.lights and np.count_nonzero(one.wrong) > 0]

    def off(value: float) -> float:
        total = 0
        for one in shown:
            tally = trial(one, bound(way, value))
            total += tally.off if tally is not None else one.wrong.size
        return total

    return sought(fit.grid, off, sum(int(np.count_nonzero(one.wrong)) for one in shown))


def sought(grid: Sequence[float], off: Callable[[float], float], before: int) -> float | None:
    """Return the value of a grid, refined, under which the fewest pixels are off; None where over half of them are."""
    if not before:
        return None
    counts = [off(value) for value in grid]
    best = int(np.argmin(counts))
    if counts[best] > before / 2:
        return None
    low, high = grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)]
    tried = dict(zip(grid, counts, strict=True))
    for parts in (12, 8):
        tried |= {float(value): off(float(value)) for value in np.linspace(low, high, parts + 1)[1:-1]}
        centre = min(tried, key=lambda value: tried[value])
        if tried[centre] == 0:
            break
        low, high = centre - (high - low) / parts, centre + (high - low) / parts
    return float(np.median([value for value, count in tried.items() if count == tried[centre]]))


def together(first: Hypothesis, second: Hypothesis) -> list[Hypothesis]:
    """Return two mistakes as one hypothesis: two where their order counts, none where one overrides the other."""
    if set(first.mistakes) & set(second.mistakes):
        return []
    return [
        Hypothesis(
            mistakes=(*first.mistakes, *second.mistakes),
            parameters={**first.parameters, **second.parameters},
            way=way,
        )
        for way in joined(first.way, second.way)
    ]


def joined(one: Way, other: Way) -> list[Way]:
    """Return two ways as one: two where their order counts, none where one overrides the other."""
    if one.shading is not None or other.shading is not None:
        return []
    if any(one.formulas[slot] != other.formulas[slot] for slot in set(one.formulas) & set(other.formulas)):
        return []
    shared = set(one.stages) & set(other.stages)
    both_asked = one.asked is not None and other.asked is not None
    orders = [(one, other), (other, one)] if shared or both_asked else [(one, other)]
    return [
        Way(
            parts=(one, other),
            asked=_asked_after(a, b),
            stages={**a.stages, **b.stages, **{stage: _after(a.stages[stage], b.stages[stage]) for stage in shared}},
            formulas={**a.formulas, **b.formulas},
        )
        for a, b in orders
    ]


def _asked_after(first: Way, second: Way) -> Callable[[Scene], Scene] | None:
    one, other = first.asked, second.asked
    if one is None or other is None:
        return one or other
    return lambda scene: other(one(scene))


def _after(first: Wrong, second: Wrong) -> Wrong:
    """Return a stage that is spoilt by two mistakes, one after the other."""
    combine = getattr(first, "followed_by", None)
    both = combine(second) if combine is not None else None
    return both or (lambda given: second(replace(given, right=first(given))))
