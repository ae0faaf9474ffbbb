"""The tail of a paired comparison: pixels that one contender gets right to a few roundings and the other does not.

A median over pixels does not see a formula that is wrong on a tenth of them. Nor do neighbours count for themselves:
the test is the sign test over tiles of an image, each of which leans to one side or the other.
Source: Dixon and Mood, "The statistical sign test" (1946); McNemar's test is the same with pixels for tiles.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rayproof.reports.studies.compare.statistics import mcnemar

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
