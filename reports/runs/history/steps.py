"""Where a series of measurements changes for good: change points in its logarithm, by absolute deviations.

Source: Killick, Fearnhead and Eckley, "Optimal Detection of Changepoints With a Linear Computational Cost" (2012), by
`ruptures` (Truong, Oudre and Vayatis 2020). The cost is the sum of absolute deviations from a segment's median, so
that one slow run is no step (Fearnhead and Rigaill, "Changepoint Detection in the Presence of Outliers", 2019); the
penalty is that of Schwarz' criterion for it, 2 sigma log n. Sigma is estimated from the first differences, which a step
disturbs once and noise always.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

NORMAL = 1.4826  # standard deviations in a median absolute deviation of normal noise
FEWEST = 4  # values below which no noise can be told from a step


@dataclass(frozen=True, kw_only=True)
class Step:
    """A change of level: the index of the first value after it, and the medians on both sides."""

    at: int
    before: float
    after: float

    @property
    def factor(self) -> float:
        """Return how many times the level was multiplied."""
        return self.after / self.before if self.before else float("inf")


def spread(values: np.ndarray) -> float:
    """Return the standard deviation of noise in a series of logarithms, steps aside (0 where all are equal)."""
    differences = np.diff(values)
    if not len(differences):
        return 0.0
    # A difference of two noisy values has twice the variance.
    return float(NORMAL * np.median(np.abs(differences - np.median(differences))) / np.sqrt(2))


def changes(series: Sequence[float], *, least: float) -> list[Step]:
    """Return the steps of positive numbers without noise, which equal code makes equal: where neighbours differ.

    `least` is the factor below which a step is of no interest (1.1: a tenth).
    """
    return [
        Step(at=at, before=before, after=after)
        for at, (before, after) in enumerate(pairwise(series), start=1)
        if abs(np.log(after / before)) >= np.log(least)
    ]


def steps(series: Sequence[float], *, least: float) -> list[Step]:
    """Return the steps of a series of noisy positive numbers, oldest first; each is held by two values at least.

    `least` is the factor below which a step is of no interest (1.2: a fifth).
    """
    import ruptures

    values = np.log(np.asarray(series, dtype=np.float64))
    if len(values) < FEWEST:
        return []
    # Noise below a tenth of what is of interest cannot make a step of interest.
    sigma = max(spread(values), np.log(least) / 10)
    search = ruptures.Pelt(model="l1", min_size=2, jump=1).fit(values.reshape(-1, 1))
    ends = search.predict(pen=2 * sigma * np.log(len(values)))
    levels = [float(np.median(values[low:high])) for low, high in pairwise([0, *ends])]
    return [
        Step(at=at, before=float(np.exp(before)), after=float(np.exp(after)))
        for at, before, after in zip(ends[:-1], levels[:-1], levels[1:], strict=True)
        if abs(after - before) >= np.log(least)
    ]
