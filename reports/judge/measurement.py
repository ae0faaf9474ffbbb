"""Measuring one image against another: error over limit, pixel by pixel, worst pixel first, nothing dropped."""

import math
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from cases.stages import Stage

DIRECTIONS = (Stage.RAY, Stage.NORMAL)


@dataclass(frozen=True, kw_only=True)
class Measurement:
    """One comparison. Non-finite numbers stay what they are here; `as_json` writes them as strings."""

    worst_ratio: float  # error / limit, inf where the limit is 0 and the error is not
    worst_error: float
    limit: float  # at the worst pixel
    pixel: tuple[int, int] | None  # column, row
    ours: tuple[float, ...]
    theirs: tuple[float, ...]
    interior: int  # pixels judged strictly that hit something (all pixels for `ray`)
    edge: int
    differ_at_edge: int
    wrong_at_edge: int  # edge pixels whose value is neither side's
    hit_miss: int  # interior pixels where one hits and the other misses or hits another object
    nan: int
    inf: int
    flagged: int
    ulp: float  # worst error in units in the last place of the reference, in float32 or float64 as computed

    def as_json(self) -> dict[str, Any]:
        """Return plain JSON data; inf and nan become the strings "inf" and "nan"."""
        return {name: jsonable(value) for name, value in asdict(self).items()}


def jsonable(value: Any) -> Any:
    """Return `value` with numbers that JSON cannot carry written as strings."""
    if isinstance(value, float) and not math.isfinite(value):
        return "nan" if math.isnan(value) else ("inf" if value > 0 else "-inf")
    if isinstance(value, tuple | list):
        return [jsonable(item) for item in value]
    if isinstance(value, np.integer):
        return int(value)
    if isinstance(value, np.floating):
        return jsonable(float(value))
    return value


def error(stage: Stage, ours: np.ndarray, theirs: np.ndarray) -> np.ndarray:
    """Return the error per pixel in the stage's own measure; equal infinities are equal, NaN stays NaN.

    Directions: angle [rad] by atan2 (Kahan, 2006), but never less than the vectors' distance, so that a wrong length
    counts; position: Euclidean distance; the rest: largest absolute difference over channels is left to the caller,
    which gets all channels.
    """
    with np.errstate(invalid="ignore", over="ignore"):
        difference = np.where(ours == theirs, 0.0, np.abs(ours - theirs))
        if stage in DIRECTIONS:
            across = np.linalg.norm(np.cross(ours, theirs), axis=-1)
            angle = np.arctan2(across, np.sum(ours * theirs, axis=-1))
            zero = ~np.any(ours, axis=-1) & ~np.any(theirs, axis=-1)
            return np.where(zero, 0.0, np.maximum(angle, np.linalg.norm(difference, axis=-1)))
        if stage is Stage.POSITION:
            return np.linalg.norm(difference, axis=-1)
    return difference


def ratios(stage: Stage, ours: np.ndarray, theirs: np.ndarray, limit: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return error / limit and error per pixel (height, width): the worst channel's; NaN counts as inf.

    Raises:
        ValueError: the images differ in shape; nothing is ever broadcast.

    """
    if ours.shape != theirs.shape:
        raise ValueError(f"{stage} images differ in shape: {ours.shape} against {theirs.shape}")
    wrong = error(stage, ours, theirs)
    if wrong.ndim == 2:
        wrong = wrong[..., np.newaxis]
    bound = limit if limit.ndim == 3 else limit[..., np.newaxis]
    with np.errstate(divide="ignore", invalid="ignore"):
        over = np.where(wrong <= 0, 0.0, wrong / np.broadcast_to(bound, wrong.shape))
    over = np.where(np.isnan(over), np.inf, over)
    worst = over.argmax(axis=-1)[..., np.newaxis]
    return np.take_along_axis(over, worst, -1)[..., 0], np.take_along_axis(wrong, worst, -1)[..., 0]


def measure(
    stage: Stage,
    ours: np.ndarray,
    theirs: np.ndarray,
    limit: np.ndarray,
    *,
    edge: np.ndarray,
    hit: np.ndarray,
    flagged: np.ndarray,
    excused: np.ndarray,
    precision: str,
) -> Measurement:
    """Measure `ours` against `theirs`: interior pixels strictly, edge pixels excused only where `excused` says so.

    `hit` is where the reference hits something; `excused` are the edge pixels whose value is one of the two sides.
    """
    ratio, wrong = ratios(stage, ours, theirs, limit)
    forgiven = edge & excused
    judged = np.where(forgiven, 0.0, ratio)
    row, column = np.unravel_index(int(judged.argmax()), judged.shape)
    bound = np.broadcast_to(
        limit if limit.ndim == 3 else limit[..., np.newaxis],
        (*judged.shape, max(1, limit.shape[-1] if limit.ndim == 3 else 1)),
    )
    over = judged[row, column] > 0
    channel_limit = (
        float(wrong[row, column] / ratio[row, column])
        if over and np.isfinite(ratio[row, column])
        else float(bound[row, column].max())
    )
    differ = ratio > 1
    misses = np.zeros_like(edge)
    if stage in (Stage.OBJECT, Stage.DISTANCE):
        misses = np.any((ours != theirs) if stage is Stage.OBJECT else (np.isinf(ours) != np.isinf(theirs)), axis=-1)
    everywhere = np.ones_like(hit) if stage is Stage.RAY else hit
    return Measurement(
        worst_ratio=float(judged[row, column]),
        worst_error=float(wrong[row, column]),
        limit=channel_limit,
        pixel=(int(column), int(row)),
        ours=tuple(map(float, ours[row, column])),
        theirs=tuple(map(float, theirs[row, column])),
        interior=int(np.count_nonzero(everywhere & ~edge)),
        edge=int(np.count_nonzero(edge)),
        differ_at_edge=int(np.count_nonzero(differ & edge)),
        wrong_at_edge=int(np.count_nonzero(differ & edge & ~excused)),
        hit_miss=int(np.count_nonzero(misses & ~edge)),
        nan=int(np.count_nonzero(np.isnan(ours).any(axis=-1))),
        inf=int(np.count_nonzero((np.isinf(ours) & ~np.isinf(theirs)).any(axis=-1) & ~forgiven)),
        flagged=int(np.count_nonzero(flagged)),
        ulp=_ulp(ours, theirs, ~forgiven, precision),
    )


def _ulp(ours: np.ndarray, theirs: np.ndarray, judged: np.ndarray, precision: str) -> float:
    """Return the worst error in units in the last place of the reference's largest component [ulp of `precision`]."""
    both = judged & np.isfinite(ours).all(axis=-1) & np.isfinite(theirs).all(axis=-1)
    if not np.any(both):
        return 0.0
    size = np.abs(theirs[both]).max(axis=-1)
    spacing = np.spacing(np.maximum(size, np.finfo(precision).tiny).astype(precision)).astype(np.float64)
    return float((np.abs(ours[both] - theirs[both]).max(axis=-1) / spacing).max())
