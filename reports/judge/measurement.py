"""The pixel counts of a check: the result of every pixel, or of every entry of the camera."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np

from rayproof.cases.scene import Camera
from rayproof.cases.stages import Stage
from rayproof.reports.judge.answers import all_of, any_of, crossed, dot, largest, length
from rayproof.reports.results.case_records import Examined, Measurement

# Pixels with a limit above this share of the value are hardly tested, and are counted separately.
WIDE = 0.01
# The camera's answer: four matrices, eight corners, and per pixel two numbers each for pixel and NDC.
MATRIX_ENTRIES, CORNER_ENTRIES, ENTRIES_PER_PIXEL = 4 * 16, 8 * 3, 2 * 2


class Kind(IntEnum):
    """The result of one pixel."""

    STRICT = 0  # within a limit of at most 1 % of the value
    WIDE = 1  # within a limit of more than 1 % of the value
    ROUNDING = 2  # over its limit, but the exact answer to a problem within rounding
    EPSILON = 3  # over its limit, but the exact answer to a problem with the renderer's declared epsilons
    WRONG = 4  # over its limit, and no nearby problem's answer
    UNEXAMINED = 5  # not tested: never measured, not compared, or the limit is not finite


def counted(kinds: np.ndarray) -> Examined:
    """Return the pixel counts of an array of `Kind`, of any shape.

    Raises:
        ValueError: a pixel's kind is not in `Kind`.

    """
    strict, *counts = np.bincount(kinds.ravel(), minlength=len(Kind)).tolist()
    if len(counts) != len(Kind) - 1:
        raise ValueError(f"a pixel is of kind {len(counts)}, and there are {len(Kind)} kinds")
    return Examined(*counts, pixels=strict + sum(counts))


@dataclass(frozen=True, kw_only=True)
class StagePixels:
    """One stage of a renderer compared with a value, pixel by pixel."""

    stage: Stage
    value: np.ndarray  # (height, width, channels), the expected value
    limit: np.ndarray  # (height, width) or (height, width, channels)
    ratio: np.ndarray  # (height, width): error over limit
    error: np.ndarray  # (height, width) or (height, width, channels)
    kinds: np.ndarray  # uint8 (height, width): each pixel's `Kind`

    @cached_property
    def wrong(self) -> np.ndarray:
        """Return the pixels (height, width) over their limits without an explanation."""
        return self.kinds == Kind.WRONG

    @cached_property
    def explained(self) -> np.ndarray:
        """Return the pixels (height, width) over their limits that rounding or a declared epsilon explains."""
        return (self.kinds == Kind.ROUNDING) | (self.kinds == Kind.EPSILON)


CELLS = 8  # rows, and columns, of the grid over an image for a gate's records of wrong pixels


def cells_of(wrong: np.ndarray) -> tuple[str, str]:
    """Return the cells of the grid with a wrong pixel, and those with a wrong pixel inside or one pixel outside.

    Each is 64 bits, row by row, as 16 hexadecimal digits. The roundings of a different processor move an outline by
    less than a pixel, so that there only cells of the second kind may be wrong.
    """
    height, width = wrong.shape
    rows, columns = np.nonzero(wrong)
    digits = []
    for reach in ((0,), (-1, 0, 1)):
        cells = np.zeros((CELLS, CELLS), dtype=bool)
        for down, right in product(reach, reach):
            low, left = (rows + down).clip(0, height - 1), (columns + right).clip(0, width - 1)
            cells[low * CELLS // height, left * CELLS // width] = True
        digits.append(np.packbits(cells).tobytes().hex())
    return digits[0], digits[1]


def unexamined(stage: Stage, camera: Camera) -> Examined:
    """Return the pixel counts of a check that ended before any measurement."""
    pixels = camera.width * camera.height
    if stage is Stage.CAMERA:
        pixels = MATRIX_ENTRIES + CORNER_ENTRIES + ENTRIES_PER_PIXEL * pixels
    return Examined(pixels=pixels, unexamined=pixels)


@dataclass(frozen=True, kw_only=True)
class Explained:
    """The pixels of one stage that are over their limits and not wrong, (height, width) each, by the reason."""

    rounding: np.ndarray  # a problem within rounding has the value
    epsilon: np.ndarray  # only a problem with the renderer's declared epsilons has the value
    unexamined: np.ndarray  # unknown: not compared, or too many lights are undecided

    @property
    def any(self) -> np.ndarray:
        """Return the pixels that are not wrong."""
        return self.rounding | self.epsilon | self.unexamined


def kinds_of(
    ratio: np.ndarray, wide: np.ndarray, bounded: np.ndarray, explained: Explained | None = None
) -> np.ndarray:
    """Return each pixel's kind, uint8 (height, width).

    `ratio` is error over limit; `wide` are the pixels with a limit above 1 % of the value, `bounded` those with a
    finite limit.
    """
    kinds = wide.astype(np.uint8)
    over = ~(ratio <= 1)
    if over.any():
        kinds[over] = Kind.WRONG
        if explained is not None:
            kinds[over & explained.unexamined] = Kind.UNEXAMINED
            kinds[over & explained.epsilon] = Kind.EPSILON
            kinds[over & explained.rounding] = Kind.ROUNDING
    if not bounded.all():
        kinds[~bounded & ~over] = Kind.UNEXAMINED
    return kinds


# The comparison of two images: error over limit, pixel by pixel.


DIRECTIONS = (Stage.RAY, Stage.NORMAL)
VECTORS = (*DIRECTIONS, Stage.POSITION)


def jsonable(value: Any) -> Any:
    """Return `value` with numbers that JSON cannot represent written as strings."""
    # The usual types first: a record contains tens of thousands of numbers.
    if type(value) is int or (type(value) is float and math.isfinite(value)):
        return value
    if isinstance(value, tuple | list):
        return [item if type(item) is float and math.isfinite(item) else jsonable(item) for item in value]
    if isinstance(value, float | np.floating):
        number = float(value)
        return number if math.isfinite(number) else "nan" if math.isnan(number) else ("inf" if number > 0 else "-inf")
    return int(value) if isinstance(value, np.integer) else value


def error(stage: Stage, image: np.ndarray, expected: np.ndarray) -> np.ndarray:
    """Return the error per pixel in the stage's measure; equal infinities have no error, and NaN remains NaN.

    Directions: angle [rad] by atan2 (Kahan, 2006), but at least the vectors' distance, so that a wrong length counts;
    position: Euclidean distance; both (height, width). Other stages: absolute difference per channel.
    """
    with np.errstate(invalid="ignore", over="ignore"):
        difference = np.asarray(image - expected)
        np.abs(difference, out=difference)
        if not difference.max(initial=0.0) < np.inf:  # nor is NaN
            difference = np.where(image == expected, 0.0, difference)
        if stage in DIRECTIONS:
            distance = length(difference)
            angle = np.arctan2(crossed(image, expected), dot(image, expected))
            return np.where(distance == 0, 0.0, np.maximum(angle, distance))
        if stage is Stage.POSITION:
            return length(difference)
    return difference


def ratios(stage: Stage, image: np.ndarray, expected: np.ndarray, limit: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the worst channel's error / limit per pixel (height, width), inf for NaN, and the `error`.

    `limit` has the error's shape, or that shape without the channels.

    Raises:
        ValueError: the images differ in shape; nothing is ever broadcast.

    """
    if image.shape != expected.shape:
        raise ValueError(f"{stage} images differ in shape: {image.shape} against {expected.shape}")
    wrong = error(stage, image, expected)
    ratio = over(wrong, limit)
    if wrong.ndim < image.ndim:
        return ratio, wrong
    return largest(ratio), wrong


def over(wrong: np.ndarray, limit: np.ndarray) -> np.ndarray:
    """Return errors over their limits, 0 without an error and inf for NaN."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        ratio = wrong / (limit if limit.ndim == wrong.ndim else limit[..., np.newaxis])
        if ratio.min(initial=0.0) >= 0:  # nor is NaN
            return ratio
    return np.where(ratio >= 0, ratio, np.where(wrong <= 0, 0.0, np.inf))


def _worst_channel(wrong: Sequence[float], limit: Sequence[float]) -> float:
    """Return one pixel's error in the channel with the largest ratio to its limit, 0 if all are exact."""
    times = [_times(*channel) for channel in zip(wrong, limit, strict=True)]
    worst = max(times)
    return wrong[times.index(worst)] if worst > 0 else 0.0


def _times(wrong: float, limit: float) -> float:
    """Return one error over its limit, 0 without an error and inf for NaN."""
    if wrong <= 0:
        return 0.0
    ratio = wrong / limit if limit > 0 else math.inf
    return math.inf if math.isnan(ratio) else ratio


def measure(
    stage: Stage,
    answer: np.ndarray,
    expected: np.ndarray,
    limit: np.ndarray,
    kinds: np.ndarray,
    *,
    hit: np.ndarray,
    precision: str,
    compared: tuple[np.ndarray, np.ndarray] | None = None,
) -> Measurement:
    """Return the measurement of one comparison from each pixel's `kinds` (height, width).

    `hit` is the mask of the oracle's hits; `compared` is the result of `ratios`, if it exists already.
    """
    ratio, wrong = compared or ratios(stage, answer, expected, limit)
    excused = (kinds == Kind.ROUNDING) | (kinds == Kind.EPSILON)
    # Unexamined pixels are counted, but are no failure.
    left_out = excused | (kinds == Kind.UNEXAMINED)
    judged = np.where(left_out, 0.0, ratio) if left_out.any() else ratio
    row, column = divmod(int(judged.argmax()), judged.shape[1])
    worst_ratio = judged[row, column]
    is_wrong = kinds == Kind.WRONG
    misses = None
    if stage is Stage.OBJECT:
        misses = (answer[..., 0] != expected[..., 0]) | (answer[..., 1] != expected[..., 1])
    elif stage is Stage.DISTANCE:
        misses = np.isinf(answer[..., 0]) != np.isinf(expected[..., 0])
    finite = bool(np.isfinite(answer).all())
    values, expected_values = (tuple(map(float, image[row, column])) for image in (answer, expected))
    errors, bounds = (np.atleast_1d(image[row, column]).tolist() for image in (wrong, limit))
    worst_error = _worst_channel(errors, bounds if len(bounds) == len(errors) else bounds * len(errors))
    everywhere = np.ones_like(hit) if stage is Stage.RAY else hit
    return Measurement(
        worst_ratio=float(worst_ratio),
        worst_error=worst_error,
        limit=float(worst_error / worst_ratio) if 0 < worst_ratio < np.inf else float(np.max(limit[row, column])),
        pixel=(column, row),
        ours=values,
        theirs=expected_values,
        interior=int(np.count_nonzero(everywhere & (ratio <= 1))),
        wrong=int(np.count_nonzero(is_wrong)),
        explained=int(np.count_nonzero(excused)),
        hit_miss=int(np.count_nonzero(misses & is_wrong)) if misses is not None else 0,
        nan=0 if finite else int(np.count_nonzero(any_of(np.isnan(answer)))),
        inf=0 if finite else _new_infinities(answer, expected, left_out),
        ulp=_ulp(values, expected_values, precision),
        mean_wrong=_mean_finite(wrong[is_wrong]) if worst_ratio > 1 else 0.0,
        kinds=kinds,
    )


def _mean_finite(errors: np.ndarray) -> float:
    """Return the mean of each pixel's largest error, without values that are not finite; 0 if none is left."""
    largest_errors = errors if errors.ndim == 1 else errors.max(axis=-1)
    finite = largest_errors[np.isfinite(largest_errors)]
    return float(finite.mean()) if finite.size else 0.0


def held_to(
    stage: Stage, limit: np.ndarray, expected: np.ndarray, size: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Return masks (height, width) of limits that are more than `WIDE` of the value, and of finite limits.

    `size` (height, width), if given, is the size of the value.
    """
    bounded = all_of(np.isfinite(limit)) if limit.ndim == 3 else np.isfinite(limit)
    return _wide(stage, limit, expected, size), bounded


def _wide(stage: Stage, limit: np.ndarray, expected: np.ndarray, size: np.ndarray | None) -> np.ndarray:
    """Return a mask (height, width): in any channel the limit is more than `WIDE` of the value, or of `size`."""
    if stage in DIRECTIONS:
        return limit > WIDE  # rad, of a unit vector
    # A black pixel or a miss has the size 0: a limit of the step of a float file there, 2^-150, is not wide.
    least = np.finfo(np.float32).tiny
    if size is not None or stage is Stage.POSITION:
        return limit > WIDE * np.maximum(length(expected) if size is None else size, least)
    values = np.maximum(np.abs(expected), least)
    return any_of((limit if limit.ndim == expected.ndim else limit[..., np.newaxis]) > WIDE * values)


def _new_infinities(image: np.ndarray, expected: np.ndarray, left_out: np.ndarray) -> int:
    """Return the number of infinite pixels at which the reference is finite, except explained and unexamined ones."""
    return int(np.count_nonzero(any_of(np.isinf(image) & ~np.isinf(expected)) & ~left_out))


def _ulp(image: Sequence[float], expected: Sequence[float], precision: str) -> float:
    """Return one pixel's error in units in the last place of the reference's largest component."""
    if not all(map(math.isfinite, (*image, *expected))) or not image:
        return 0.0 if image == expected else math.inf
    size = max(*map(abs, expected), float(np.finfo(precision).tiny))
    # Python's division: for a black reference the quotient may overflow to inf, without a warning of NumPy's.
    farthest = max(abs(value - expected_value) for value, expected_value in zip(image, expected, strict=True))
    return farthest / float(np.spacing(np.asarray(size, dtype=precision)))
