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
FEWEST = 9  # the least number of values for an interval of the median; that of fewer values is their whole range
REPLICATES = 1000

Interval = tuple[float, float]


def mcnemar(only_first: int, only_second: int) -> float:
    """Return the two-sided exact p value of equal error rates, from the numbers of pixels at which only one errs."""
    from scipy import stats  # here, because it takes most of a second

    discordant = only_first + only_second
    return float(stats.binomtest(only_first, discordant).pvalue) if discordant else 1.0


def too_few(repetitions: int) -> str:
    """Return the message for a number of repetitions that is too small."""
    return (
        f"{repetitions} are too few, at least {FEWEST} are needed: the 95 % interval of the median of fewer times is "
        "the range from the shortest to the longest, so that one slow launch decides"
    )


def shared(level: float, among: int) -> float:
    """Return the level of each of `among` intervals for which all together hold at `level` (Bonferroni)."""
    return 1 - (1 - level) / max(1, among)


def median_interval(values: Sequence[float], *, level: float) -> Interval:
    """Return the bootstrap percentile interval of the median of an odd number of independent values.

    The probability that the median of a resample is at most the k-th smallest value is the probability that more than
    half of n draws are among the k smallest, so no resample needs to be drawn.

    Raises:
        ValueError: there are no values, or an even number.

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
    """Return `REPLICATES` medians of values (tiles, values per tile), whole tiles resampled with replacement.

    NaN are left out. Neighbouring pixels share geometry and therefore errors: resampling single pixels would count the
    same evidence many times.
    """
    drawn = generator.integers(len(tiles), size=(REPLICATES, len(tiles)))
    return np.nanmedian(tiles[drawn].reshape(REPLICATES, -1), axis=1)


def scene_means(replicates: np.ndarray, generator: np.random.Generator) -> np.ndarray:
    """Return replicates of the mean over scenes, from replicates (scenes, REPLICATES), the scenes resampled too."""
    scenes, count = replicates.shape
    drawn = generator.integers(scenes, size=(scenes, count))
    return replicates[drawn, np.arange(count)].mean(axis=0)


# The tail of a paired comparison: pixels where only one formula is right to a few roundings.
#
# A median over pixels is not affected by a formula that is wrong in a tenth of them. Since neighbouring pixels are not
# independent, the sign test is applied to the tiles of an image. Each tile favours one formula or neither.
# Source: Dixon and Mood, "The statistical sign test" (1946); McNemar's test is the same with pixels for tiles.


# error / (K u) of a backward stable formula, as in the ladders' gates; an error below one roundoff counts as one.
FACTOR = 4.0
TILE = 8  # width and height of a tile [pixels]


def lost(errors: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Return the mask of `errors` [K u] above `FACTOR` times `others`, which count as 1 at least; False for NaN."""
    return (errors > FACTOR * np.maximum(others, 1.0)) & np.isfinite(others)


def leaning(base: np.ndarray, candidate: np.ndarray) -> np.ndarray:
    """Return -1 where only the candidate loses the pixel, 1 where only the base does, else 0.

    Both errors are in K u of the same unit roundoff u.
    """
    return lost(base, candidate).astype(int) - lost(candidate, base).astype(int)


@dataclass(frozen=True, kw_only=True)
class Tail:
    """The counts of pixels and tiles of a family that only one formula loses, and their significance."""

    better: int  # pixels that only the base loses
    worse: int  # pixels that only the candidate loses
    tiles_better: int  # tiles with more `better` than `worse` pixels
    tiles_worse: int
    scenes: int  # scenes with such pixels
    p: float  # exact two-sided p value of equally many tiles of either kind

    @classmethod
    def of(cls, scenes: Sequence[np.ndarray]) -> "Tail":
        """Return the tail of scenes, from the `leaning` (height, width) of each scene, summed over its stages."""
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
        """Return 1 if more tiles are better, -1 if more are worse, else 0."""
        return int(np.sign(self.tiles_better - self.tiles_worse))


def _tiles(scene: np.ndarray) -> np.ndarray:
    """Return the sums over the tiles of an image (height, width); tiles at the right and bottom may be smaller."""
    height, width = scene.shape
    rows, columns = np.arange(0, height, TILE), np.arange(0, width, TILE)
    return np.add.reduceat(np.add.reduceat(scene, rows, axis=0), columns, axis=1).ravel()
