"""`climb`: the errors of one formula at each value of a ladder, and the slope of their medians, log against log.

The slope is fitted by weighted least squares; the weight of a median is the inverse of its bootstrap variance. Its
interval comes from a bootstrap at two levels: the rays of each value, which gives the median's scatter, and the values
themselves, because the deviations from a straight line add uncertainty, too.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import stats

from rayproof.cases.ladders import Inputs, Ladder
from rayproof.reports.studies.stability.questions import QUESTIONS, ExactAnswers, Grades
from rayproof.reports.studies.stability.records import Rung
from rayproof.tracer.formulas import FORMULAS, Formula
from rayproof.tracer.formulas.own_file import is_own

RESAMPLES = 400
LEAST_POINTS = 3
LEVEL = 0.95


@dataclass(frozen=True, kw_only=True)
class Slope:
    """A fitted slope and its interval; None if fewer than `LEAST_POINTS` values can be used."""

    value: float | None
    interval: tuple[float, float] | None
    used: tuple[float, ...]  # parameters that were not dropped


def fitted(parameters: Sequence[float], errors: Sequence[np.ndarray], *, saturated: float, seed: int) -> Slope:
    """Return the slope of the medians of `errors`, one array per value, over `parameters`.

    Medians of zero are dropped, and medians of at least `saturated`: where every digit is lost, errors grow no further.
    """
    kept = [
        (parameter, np.sort(error))
        for parameter, error in zip(parameters, errors, strict=True)
        if parameter > 0 and error.size >= LEAST_POINTS and 0 < np.median(error) < saturated
    ]
    used = tuple(parameter for parameter, _ in kept)
    if len(kept) < LEAST_POINTS:
        return Slope(value=None, interval=None, used=used)
    generator = np.random.default_rng(seed)
    x = np.log10(used)
    y = np.log10([np.median(error) for _, error in kept])
    medians = np.array([resampled(error, generator) for _, error in kept])
    # Bound the weights: a value whose medians hardly scatter must not outweigh all others, as no line is that exact.
    weights = 1 / (np.var(medians, axis=1) + 0.02**2)
    value = float(_lines(x, y, weights))
    chosen = generator.integers(len(x), size=(RESAMPLES, len(x)))
    ordered = np.sort(chosen, axis=1)
    chosen = chosen[1 + np.sum(ordered[:, 1:] != ordered[:, :-1], axis=1) >= LEAST_POINTS]
    picked = medians[chosen, np.arange(len(chosen))[:, None]]
    slopes = _lines(x[chosen], picked, weights[chosen])
    low, high = np.quantile(slopes, [(1 - LEVEL) / 2, (1 + LEVEL) / 2])
    return Slope(value=value, interval=(float(low), float(high)), used=used)


def resampled(error: np.ndarray, generator: np.random.Generator) -> np.ndarray:
    """Return log10 of `RESAMPLES` medians of resamples of sorted errors, drawn by the ranks of such medians."""
    half = (error.size + 1) / 2
    ranks = (generator.beta(half, half, RESAMPLES) * error.size).astype(int)
    return np.log10(np.maximum(error[ranks], np.finfo(np.float64).tiny))


def _lines(x: np.ndarray, y: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return the slopes of weighted lines, one per row."""
    weights = weights / np.sum(weights, axis=-1, keepdims=True)
    x = x - np.sum(weights * x, axis=-1, keepdims=True)
    y = y - np.sum(weights * y, axis=-1, keepdims=True)
    return np.sum(weights * x * y, axis=-1) / np.sum(weights * x * x, axis=-1)


# One formula on one ladder: the grades at every value, the fitted slope and the breakpoint.


@dataclass(frozen=True, kw_only=True)
class Climb:
    """The results of one formula on one ladder in one precision."""

    ladder: Ladder
    formula: Formula
    precision: str
    rungs: tuple[Rung, ...]
    slope: Slope

    @property
    def breakpoint(self) -> float | None:
        """Return the last value before the first that misses the gate, None if the first value misses it."""
        last = None
        for rung in self.rungs:
            if not self.holds(rung):
                break
            last = rung.value
        return last

    def holds(self, rung: Rung) -> bool:
        """Return whether the results at a value pass the gate; a value without counted rays does not."""
        gate = self.ladder.gate
        small = rung.scaled_error is None or rung.scaled_error <= gate.index
        few = 0.0 if self.formula.variant in gate.faultless else gate.misclassified
        return rung.rays > 0 and rung.misclassified <= few and small

    @property
    def worst_index(self) -> float | None:
        """Return the largest error / (K u) over all values."""
        return max((rung.scaled_error for rung in self.rungs if rung.scaled_error is not None), default=None)

    def total(self, name: str) -> int:
        """Return the sum of a count over all values."""
        return sum(int(getattr(rung, name)) for rung in self.rungs)


@dataclass(frozen=True, kw_only=True)
class Drawn:
    """A ladder's inputs in one precision, and the truth about them."""

    ladder: Ladder
    precision: str
    inputs: Inputs
    rungs: np.ndarray  # (rays,) index of the value
    truth: ExactAnswers


def drawn(ladder: Ladder, precision: str, *, quick: bool) -> Drawn:
    """Return the inputs of all values, drawn by the ladder's seed, and the truth."""
    generator = np.random.default_rng(ladder.seed)
    rays = ladder.quick_rays if quick else ladder.rays
    parts = [ladder.draw(value, rays, generator, precision) for value in ladder.values]
    inputs = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    lengths = [len(next(iter(part.values()))) for part in parts]
    rungs = np.repeat(np.arange(len(ladder.values)), lengths)
    truth = QUESTIONS[ladder.question]().truth(ladder, inputs, rungs)
    return Drawn(ladder=ladder, precision=precision, inputs=inputs, rungs=rungs, truth=truth)


def climb(batch: Drawn, formula: Formula) -> Climb:
    """Compute a formula on all inputs of a ladder and grade the answers."""
    question, ladder = QUESTIONS[batch.ladder.question](), batch.ladder
    answer = question.answer(ladder, formula, batch.inputs, batch.precision)
    grades = question.grade(ladder, batch.inputs, batch.truth, answer, batch.precision)
    parts = [np.flatnonzero((batch.rungs == i) & grades.counted) for i in range(len(ladder.values))]
    rungs = tuple(_rung(value, grades, part) for value, part in zip(ladder.values, parts, strict=True))
    errors = [_finite(grades.error[part]) for part in parts]
    # A user's own formula has no predicted slope; the law of its slot's default gives the first value for the fit.
    variant = FORMULAS.slots[formula.slot] if is_own(formula.variant) else formula.variant
    law = ladder.predicted(f"{formula.slot}/{variant}", batch.precision)
    first = law.skip if law else 0
    slope = fitted(ladder.values[first:], errors[first:], saturated=ladder.saturated, seed=ladder.seed % 2**32)
    return Climb(ladder=ladder, formula=formula, precision=batch.precision, rungs=rungs, slope=slope)


def _finite(values: np.ndarray) -> np.ndarray:
    return values[np.isfinite(values)]


def _median_interval(values: np.ndarray) -> tuple[float, float]:
    """Return a distribution-free 95 % interval of the median; the number of n values below it is binomial."""
    ordered, n = np.sort(values), len(values)
    below = max(0, int(stats.binom.ppf(0.025, n, 0.5)) - 1)
    return float(ordered[below]), float(ordered[n - 1 - below])


def _spread(error: np.ndarray) -> dict[str, Any]:
    """Return the quantiles of errors by the field names of a ladder's value; an empty dict without errors."""
    if not error.size:
        return {}
    middle, high, worst = np.quantile(error, (0.5, 0.99, 1.0))
    low, up = _median_interval(error)
    return {
        "median": float(middle),
        "median_low": low,
        "median_high": up,
        "p99": float(high),
        "worst": float(worst),
    }


def _rung(value: float, grades: Grades, part: np.ndarray) -> Rung:
    error, index = _finite(grades.error[part]), _finite(grades.index[part])
    invalid = grades.invalid[part]
    return Rung(
        value=value,
        rays=len(part),
        false_hits=int(np.sum(grades.false_hit[part] & ~invalid)),
        false_misses=int(np.sum(grades.false_miss[part] & ~invalid)),
        invalid=int(np.sum(invalid)),
        scaled_error=float(index.max()) if index.size else None,
        **{name: int(np.sum(count[part])) for name, count in grades.counts.items()},
        **_spread(error),
    )
