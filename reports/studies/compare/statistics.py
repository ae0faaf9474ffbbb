"""Statistics of paired comparisons: exact McNemar, medians with bootstrap intervals, clusters, tails.

Sources: McNemar, "Note on the sampling error of the difference between correlated proportions" (1947), in its exact
binomial form; Efron, "Bootstrap methods: another look at the jackknife" (1979), section 3, for the bootstrap
distribution of a median, which is known exactly; Davison and Hinkley, Bootstrap Methods and their Application (1997),
section 3.8, for clusters.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

LEVEL = 0.95
FEWEST = 9  # the least number of values for an interval of the median; with fewer it is their whole range
REPLICATES = 1000

Interval = tuple[float, float]


def mcnemar(only_first: int, only_second: int) -> float:
    """Return the two-sided exact p value that two error rates are equal, from the pixels at which just one errs."""
    from scipy import stats  # here, because it takes most of a second

    discordant = only_first + only_second
    return float(stats.binomtest(only_first, discordant).pvalue) if discordant else 1.0


def too_few(repetitions: int) -> str:
    """Return in a sentence why so many repetitions are refused."""
    return (
        f"{repetitions} are too few, at least {FEWEST} are needed: the 95 % interval of the median of fewer times is "
        "the range from the shortest to the longest, so that one slow launch decides"
    )


def shared(level: float, among: int) -> float:
    """Return the level at which each of `among` intervals holds for all to hold together at `level` (Bonferroni)."""
    return 1 - (1 - level) / max(1, among)


def median_interval(values: Sequence[float], *, level: float) -> Interval:
    """Return the bootstrap percentile interval of the median of an odd number of independent values.

    The median of a resample is at most the k-th smallest value with the probability that more than half of n draws are
    among the k smallest, so that no resample need be drawn.

    Raises:
        ValueError: there are none, or an even number.

    """
    from scipy import special  # here, so that a benchmark's processes can time before they import it

    ordered = np.sort(np.asarray(values, dtype=np.float64))
    n = len(ordered)
    if n % 2 == 0:
        raise ValueError(f"an odd number of values has a median among them; got {n}")
    k = np.arange(1, n + 1)
    at_most = special.bdtrc(n // 2, n, k / n)
    tail = (1 - level) / 2
    low = int(np.searchsorted(at_most, tail, side="right"))
    high = int(np.searchsorted(at_most, 1 - tail, side="left"))
    return float(ordered[low]), float(ordered[high])


def percentile_interval(replicates: np.ndarray, *, level: float) -> Interval:
    """Return the central interval of bootstrap replicates."""
    low, high = np.quantile(replicates, [(1 - level) / 2, (1 + level) / 2])
    return float(low), float(high)


def tile_medians(tiles: np.ndarray, generator: np.random.Generator) -> np.ndarray:
    """Return `REPLICATES` medians of values (tiles, values a tile), whole tiles drawn again with replacement.

    NaN are left out. Neighbouring pixels share geometry and so errors: drawing pixels one by one would count the
    same evidence many times.
    """
    drawn = generator.integers(len(tiles), size=(REPLICATES, len(tiles)))
    return np.nanmedian(tiles[drawn].reshape(REPLICATES, -1), axis=1)


def scene_means(replicates: np.ndarray, generator: np.random.Generator) -> np.ndarray:
    """Return replicates of the mean over scenes, from each scene's (scenes, REPLICATES), scenes drawn again too."""
    scenes, count = replicates.shape
    drawn = generator.integers(scenes, size=(scenes, count))
    return replicates[drawn, np.arange(count)].mean(axis=0)


# The tail of a paired comparison: pixels in which only one formula is right to a few roundings.
#
# A median over pixels is not affected by a formula that is wrong in a tenth of them. Since neighbouring pixels are not
# independent, the sign test is applied to tiles of an image, each of which favours one formula or the other.
# Source: Dixon and Mood, "The statistical sign test" (1946); McNemar's test is the same with pixels for tiles.


# error / (K u) of a backward stable formula, the gate of the ladders, too; an error below one roundoff counts as one.
FACTOR = 4.0
TILE = 8  # pixels a side


def lost(errors: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Return where `errors` [K u] are more than a roundoff-derived factor larger than `others`; NaN is never lost."""
    return (errors > FACTOR * np.maximum(others, 1.0)) & np.isfinite(others)


def leaning(base: np.ndarray, candidate: np.ndarray) -> np.ndarray:
    """Return -1 where the candidate loses the pixel, 1 where the base does, else 0, from errors [K u] of one u."""
    return lost(base, candidate).astype(int) - lost(candidate, base).astype(int)


@dataclass(frozen=True, kw_only=True)
class Tail:
    """How a family's pixels lean."""

    better: int  # pixels that only the base loses
    worse: int  # pixels that only the candidate loses
    tiles_better: int  # tiles with more of the first
    tiles_worse: int
    scenes: int  # that lean at all
    p: float  # exact two-sided p value that tiles lean either way alike

    @classmethod
    def of(cls, scenes: Sequence[np.ndarray]) -> "Tail":
        """Return the tail of scenes, from each one's `leaning` (height, width), summed over its stages."""
        tiles = np.concatenate([np.sign(_tiles(scene)) for scene in scenes]) if scenes else np.empty(0)
        better, worse = (int(np.count_nonzero(tiles == sign)) for sign in (1, -1))
        return cls(
            better=sum(int(scene[scene > 0].sum()) for scene in scenes),
            worse=sum(-int(scene[scene < 0].sum()) for scene in scenes),
            tiles_better=better,
            tiles_worse=worse,
            scenes=sum(bool(np.any(scene)) for scene in scenes),
            p=mcnemar(better, worse),
        )

    @property
    def sign(self) -> int:
        """Return where most tiles lean."""
        return int(np.sign(self.tiles_better - self.tiles_worse))


def _tiles(scene: np.ndarray) -> np.ndarray:
    """Return the sums over tiles of an image (height, width); those at the right and the bottom may be smaller."""
    height, width = scene.shape
    rows, columns = np.arange(0, height, TILE), np.arange(0, width, TILE)
    return np.add.reduceat(np.add.reduceat(scene, rows, axis=0), columns, axis=1).ravel()
