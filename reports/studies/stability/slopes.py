"""The slope of the median error against the parameter, log against log, with a bootstrap interval.

Weighted least squares; a median's weight is the inverse of its variance, read off the sorted errors around it. An
interval comes from resampling twice over: every value's median within its rays, and the values themselves, because
what a straight line does not explain is uncertainty too.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

RESAMPLES = 400
LEAST_POINTS = 3
LEVEL = 0.95


@dataclass(frozen=True, kw_only=True)
class Slope:
    """A fitted slope and its interval; None where fewer than three values say anything."""

    value: float | None
    interval: tuple[float, float] | None
    used: tuple[float, ...]  # parameters that were not dropped


def fitted(parameters: Sequence[float], errors: Sequence[np.ndarray], *, saturated: float, seed: int) -> Slope:
    """Return the slope over `parameters` of the median of each one's positive `errors`.

    Dropped: medians of zero, and medians from `saturated` on, which say that everything is lost and not how fast.
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
    # A value whose medians hardly scatter must not outweigh all others: the line is never that exact.
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
    """Return log10 of `RESAMPLES` medians of resamples of sorted errors: those at the ranks that such medians have."""
    half = (error.size + 1) / 2
    ranks = (generator.beta(half, half, RESAMPLES) * error.size).astype(int)
    return np.log10(np.maximum(error[ranks], np.finfo(np.float64).tiny))


def _lines(x: np.ndarray, y: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return the slopes of weighted lines, one per row."""
    weights = weights / np.sum(weights, axis=-1, keepdims=True)
    x = x - np.sum(weights * x, axis=-1, keepdims=True)
    y = y - np.sum(weights * y, axis=-1, keepdims=True)
    return np.sum(weights * x * y, axis=-1) / np.sum(weights * x * x, axis=-1)
