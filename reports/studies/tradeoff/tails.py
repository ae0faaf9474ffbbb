"""Tails of errors with their intervals: what a diagram's vertical axis shows."""

from collections.abc import Sequence

import numpy as np

from rayproof.reports.studies.compare.statistics import LEVEL, Interval, percentile_interval

TAIL = 0.99  # of the pixels; the worst of all cannot be estimated, only met
TILE = 32  # neighbouring pixels that are drawn again together
REPLICATES = 200
# An error of exactly 0 has no place on a logarithmic axis; float64's roundoff is 2^-29 of float32's.
LEAST = 2.0**-40
SEED = 5


def tail(scenes: Sequence[np.ndarray]) -> tuple[float, Interval]:
    """Return the 99 % quantile of the scenes' errors (NaN left out) and its bootstrap interval, tiles drawn again."""
    values = [scene[np.isfinite(scene)] for scene in scenes]
    tiles = [run for scene in values for run in np.array_split(scene, max(1, len(scene) // TILE)) if len(run)]
    if not tiles:
        return float("nan"), (float("nan"), float("nan"))
    generator = np.random.default_rng(SEED)
    replicates = np.array(
        [
            np.quantile(
                np.concatenate([tiles[index] for index in generator.integers(len(tiles), size=len(tiles))]), TAIL
            )
            for _ in range(REPLICATES)
        ]
    )
    low, high = percentile_interval(replicates, level=LEVEL)
    at = quantile(scenes)
    return max(at, LEAST), (max(min(low, at), LEAST), max(high, at, LEAST))


def quantile(scenes: Sequence[np.ndarray]) -> float:
    """Return the 99 % quantile of the scenes' errors; NaN are left out, and NaN is the answer where nothing is left."""
    values = np.concatenate([scene[np.isfinite(scene)] for scene in scenes])
    return float(np.quantile(values, TAIL)) if len(values) else float("nan")


def root_mean_square(image: np.ndarray, truth: np.ndarray) -> tuple[float, Interval]:
    """Return the RMSE of two images (height, width, channels) over the truth's mean, rows of pixels drawn again."""
    squares = ((image - truth) ** 2).mean(axis=(1, 2))
    scale = float(np.abs(truth).mean()) or 1.0
    drawn = np.random.default_rng(SEED).integers(len(squares), size=(REPLICATES, len(squares)))
    low, high = percentile_interval(np.sqrt(squares[drawn].mean(axis=1)), level=LEVEL)
    at = float(np.sqrt(squares.mean()))
    return max(at / scale, LEAST), (max(low / scale, LEAST), max(high / scale, LEAST))
