"""Mistakes as hypotheses about one renderer: with their parameters estimated from it, alone and two at a time."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rayproof.cases.stages import Stage
from rayproof.reports.diagnosis import MISTAKES, Fit, Given, Way, Wrong
from rayproof.reports.diagnosis.trial import Evidence, trial
from rayproof.reports.judge.tolerance.pair_limits import LIGHT

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
        return MISTAKES[name].sentence(self.parameters.get(name, 0.0)) + where

    @property
    def items(self) -> tuple[str, ...]:
        """Return the specification items that the mistakes concern."""
        return tuple(dict.fromkeys(item for name in self.mistakes for item in MISTAKES[name].items))


def singles(evidence: Sequence[Evidence]) -> Iterator[Hypothesis]:
    """Yield every mistake in each of its ways; those with a parameter as the evidence estimates it, if it does."""
    for name in MISTAKES:
        mistake = MISTAKES[name]
        if mistake.seen is not None:
            continue
        parameters = {}
        if mistake.fit is not None:
            estimate = estimated(mistake.fit, mistake.ways[0], evidence)
            if estimate is None:
                continue
            parameters = {name: estimate}
        for way in mistake.ways:
            yield Hypothesis(mistakes=(name,), parameters=parameters, way=bound(way, parameters.get(name, 0.0)))


def in_one_light(
    hypotheses: Sequence[Hypothesis], failing: Sequence[Evidence], modes: Sequence[str]
) -> list[Hypothesis]:
    """Return the hypotheses about light alone, each restricted to one model of light.

    A renderer that computes the models apart may be wrong in one of them. What does not fit the first failing case of a
    model is left out.
    """
    found = []
    for mode in modes:
        first = next((case for case in failing if case.scene.shading == mode), None)
        for one in hypotheses:
            about_light = bool(one.way.stages) and set(one.way.stages) <= set(LIGHT)
            if first is None or not about_light or one.way.asked is not None or one.way.laid is not None:
                continue
            tally = trial(first, one.way)
            if tally is not None and tally.fits:
                found.append(replace(one, way=replace(one.way, shading=mode)))
    return found


def bound(way: Way, parameter: float) -> Way:
    """Return a way whose stages are computed with a parameter."""
    if not parameter:
        return way

    def with_it(wrong: Wrong) -> Wrong:
        return lambda given: wrong(replace(given, parameter=parameter))

    return replace(way, stages={stage: with_it(wrong) for stage, wrong in way.stages.items()})


def estimated(fit: Fit, way: Way, evidence: Sequence[Evidence]) -> float | None:
    """Return a parameter's estimate, the middle sample; None where there are few, or they do not agree."""
    if fit.grid:
        return _sought(fit, way, evidence)
    found = [
        fit.samples(one.scene, {stage: np.asarray(image) for stage, image in one.right.answers.items()}, dict(one.ours))
        for one in evidence
        if one.scene.lights and (Stage.RADIANCE in one.stages)
    ]
    samples = np.concatenate(found) if found else np.zeros(0)
    if len(samples) < LEAST_SAMPLES:
        return None
    middle = float(np.median(samples))
    near = abs(middle) > SPREAD and np.median(np.abs(samples - middle)) <= SPREAD * abs(middle)
    return middle if near and abs(middle - fit.nothing) > SPREAD else None


def _sought(fit: Fit, way: Way, evidence: Sequence[Evidence]) -> float | None:
    """Return the value of a grid, refined, under which the fewest pixels are off; None where none is nearer."""
    shown = [one for one in evidence if one.scene.lights and np.count_nonzero(one.wrong) > 0][:2]
    if not shown:
        return None

    def off(value: float) -> float:
        total = 0
        for one in shown:
            tally = trial(one, bound(way, value))
            total += tally.off if tally is not None else one.wrong.size
        return total

    counts = [off(value) for value in fit.grid]
    best = int(np.argmin(counts))
    before = sum(np.count_nonzero(one.wrong) for one in shown)
    if counts[best] > before / 2:
        return None
    low, high = fit.grid[max(best - 1, 0)], fit.grid[min(best + 1, len(fit.grid) - 1)]
    tried = dict(zip(fit.grid, counts, strict=True))
    for value in np.linspace(low, high, 13)[1:-1]:
        tried[float(value)] = off(float(value))
    least = min(tried.values())
    if least > 0:
        centre = min(tried, key=lambda value: tried[value])
        step = (high - low) / 12
        for value in np.linspace(centre - step, centre + step, 9)[1:-1]:
            tried[float(value)] = off(float(value))
        least = min(tried.values())
    return float(np.median([value for value, count in tried.items() if count == least]))


def together(first: Hypothesis, second: Hypothesis) -> Hypothesis | None:
    """Return two mistakes as one hypothesis; None where they spoil the same."""
    one, other = first.way, second.way
    if set(one.stages) & set(other.stages) or set(one.formulas) & set(other.formulas):
        return None
    if set(first.mistakes) & set(second.mistakes) or (one.laid is not None and other.laid is not None):
        return None
    asked = [way.asked for way in (one, other) if way.asked is not None]

    def both(scene):
        for change in asked:
            scene = change(scene)
        return scene

    return Hypothesis(
        mistakes=(*first.mistakes, *second.mistakes),
        parameters={**first.parameters, **second.parameters},
        way=Way(
            asked=both if asked else None,
            laid=one.laid or other.laid,
            stages={**one.stages, **other.stages},
            formulas={**one.formulas, **other.formulas},
        ),
    )


__all__ = ["Given", "Hypothesis", "bound", "estimated", "singles", "together"]
