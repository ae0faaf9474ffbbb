"""The ledger of what a check examined: what became of every pixel, or of every entry of the camera, none left out."""

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

# A limit above this share of the value holds a pixel to so little that it is counted apart.
WIDE = 0.01
# The camera's answer: four matrices, eight corners, and two numbers a pixel each for pixel and NDC.
MATRIX_ENTRIES, CORNER_ENTRIES, ENTRIES_PER_PIXEL = 4 * 16, 8 * 3, 2 * 2


class Kind(IntEnum):
    """The result of one pixel."""

    STRICT = 0  # within a limit of at most 1 % of the value
    WIDE = 1  # likewise, but the limit is more than 1 % of the value
    ROUNDING = 2  # over its limit, and the exact answer to a problem within rounding
    EPSILON = 3  # likewise, of a problem that also overlooks what the renderer declares
    WRONG = 4  # over its limit, and no nearby problem's answer
    UNEXAMINED = 5  # held to nothing: never measured, not asked, or the limit is not finite


def counted(kinds: np.ndarray) -> Examined:
    """Return the ledger of pixels, each a `Kind`; of any shape.

    Raises:
        ValueError: a pixel is of no kind.

    """
    strict, *counts = np.bincount(kinds.ravel(), minlength=len(Kind)).tolist()
    if len(counts) != len(Kind) - 1:
        raise ValueError(f"a pixel is of kind {len(counts)}, and there are {len(Kind)} kinds")
    return Examined(*counts, pixels=strict + sum(counts))


@dataclass(frozen=True, kw_only=True)
class StagePixels:
    """One stage of a renderer against a value, pixel by pixel."""

    stage: Stage
    value: np.ndarray  # (height, width, channels) that it is compared with
    limit: np.ndarray  # (height, width) or (height, width, channels)
    ratio: np.ndarray  # (height, width): error over limit
    error: np.ndarray  # (height, width) or (height, width, channels)
    kinds: np.ndarray  # uint8 (height, width): each pixel's `Kind`

    @cached_property
    def wrong(self) -> np.ndarray:
        """Return the pixels (height, width) that nothing explains."""
        return self.kinds == Kind.WRONG

    @cached_property
    def explained(self) -> np.ndarray:
        """Return the pixels (height, width) over their limits that rounding or a declared epsilon explains."""
        return (self.kinds == Kind.ROUNDING) | (self.kinds == Kind.EPSILON)


CELLS = 8  # rows, and columns, of the grid over an image by which a gate remembers where pixels are wrong


def cells_of(wrong: np.ndarray) -> tuple[str, str]:
    """Return which cells of the grid hold a wrong pixel, and which hold one or lie within a pixel of one.

    Each is 64 bits, row by row, as 16 hexadecimal digits. Another processor's roundings move an outline by less than a
    pixel, so that the second is what may be wrong there.
    """
    height, width = wrong.shape
    rows, columns = np.nonzero(wrong)
    found = []
    for reach in ((0,), (-1, 0, 1)):
        cells = np.zeros((CELLS, CELLS), dtype=bool)
        for down, right in product(reach, reach):
            low, left = (rows + down).clip(0, height - 1), (columns + right).clip(0, width - 1)
            cells[low * CELLS // height, left * CELLS // width] = True
        found.append(np.packbits(cells).tobytes().hex())
    return found[0], found[1]


def unexamined(stage: Stage, camera: Camera) -> Examined:
    """Return the ledger of a check that ended before anything was measured."""
    pixels = camera.width * camera.height
    if stage is Stage.CAMERA:
        pixels = MATRIX_ENTRIES + CORNER_ENTRIES + ENTRIES_PER_PIXEL * pixels
    return Examined(pixels=pixels, unexamined=pixels)


@dataclass(frozen=True, kw_only=True)
class Explained:
    """The pixels of one stage that are over their limits and not wrong, (height, width) each, by the reason."""

    rounding: np.ndarray  # a problem within rounding has the value
    epsilon: np.ndarray  # only one that also overlooks what the renderer declares has it
    unexamined: np.ndarray  # nobody knows: not asked, or too many lights are undecided

    @property
    def any(self) -> np.ndarray:
        """Return the pixels that are not wrong."""
        return self.rounding | self.epsilon | self.unexamined


def kinds_of(
    ratio: np.ndarray, wide: np.ndarray, bounded: np.ndarray, explained: Explained | None = None
) -> np.ndarray:
    """Return each pixel's kind, uint8 (height, width).

    `ratio` is error over limit; `wide` and `bounded` say of the limit that it is above 1 % of the value and that it is
    finite.
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


# Measuring one image against another: error over limit, pixel by pixel, worst pixel first, nothing dropped.


DIRECTIONS = (Stage.RAY, Stage.NORMAL)
VECTORS = (*DIRECTIONS, Stage.POSITION)


def jsonable(value: Any) -> Any:
    """Return `value` with numbers that JSON cannot carry written as strings."""
    # The usual kinds first: a record holds tens of thousands of numbers.
    if type(value) is int or (type(value) is float and math.isfinite(value)):
        return value
    if isinstance(value, tuple | list):
        return [item if type(item) is float and math.isfinite(item) else jsonable(item) for item in value]
    if isinstance(value, float | np.floating):
        number = float(value)
        return number if math.isfinite(number) else "nan" if math.isnan(number) else ("inf" if number > 0 else "-inf")
    return int(value) if isinstance(value, np.integer) else value


def error(stage: Stage, ours: np.ndarray, theirs: np.ndarray) -> np.ndarray:
    """Return the error per pixel in the stage's own measure; equal infinities are equal, NaN stays NaN.

    Directions: angle [rad] by atan2 (Kahan, 2006), but never less than the vectors' distance, so that a wrong length
    counts; position: Euclidean distance; both (height, width). The rest: absolute difference, all channels.
    """
    with np.errstate(invalid="ignore", over="ignore"):
        difference = np.asarray(ours - theirs)
        np.abs(difference, out=difference)
        if not difference.max(initial=0.0) < np.inf:  # nor is NaN
            difference = np.where(ours == theirs, 0.0, difference)
        if stage in DIRECTIONS:
            distance = length(difference)
            angle = np.arctan2(crossed(ours, theirs), dot(ours, theirs))
            return np.where(distance == 0, 0.0, np.maximum(angle, distance))
        if stage is Stage.POSITION:
            return length(difference)
    return difference


def ratios(stage: Stage, ours: np.ndarray, theirs: np.ndarray, limit: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return error / limit per pixel (height, width), the worst channel's, and the `error`; NaN counts as inf.

    `limit` has the error's shape, or that shape without the channels.

    Raises:
        ValueError: the images differ in shape; nothing is ever broadcast.

    """
    if ours.shape != theirs.shape:
        raise ValueError(f"{stage} images differ in shape: {ours.shape} against {theirs.shape}")
    wrong = error(stage, ours, theirs)
    ratio = over(wrong, limit)
    if wrong.ndim < ours.ndim:
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
    """Return one pixel's error: that of the channel that is farthest over its limit, 0 where none is off."""
    times = [_times(*both) for both in zip(wrong, limit, strict=True)]
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
    ours: np.ndarray,
    theirs: np.ndarray,
    limit: np.ndarray,
    kinds: np.ndarray,
    *,
    hit: np.ndarray,
    precision: str,
    compared: tuple[np.ndarray, np.ndarray] | None = None,
) -> Measurement:
    """Return the numbers of one comparison, of which each pixel's `kinds` (height, width) are known.

    `hit` is where the oracle hits something, and `compared` what `ratios` returns, if that is known.
    """
    ratio, wrong = compared or ratios(stage, ours, theirs, limit)
    excused = (kinds == Kind.ROUNDING) | (kinds == Kind.EPSILON)
    # Of what was not examined nobody knows: it is counted, and is no failure.
    left_out = excused | (kinds == Kind.UNEXAMINED)
    judged = np.where(left_out, 0.0, ratio) if left_out.any() else ratio
    row, column = divmod(int(judged.argmax()), judged.shape[1])
    there = judged[row, column]
    is_wrong = kinds == Kind.WRONG
    misses = None
    if stage is Stage.OBJECT:
        misses = (ours[..., 0] != theirs[..., 0]) | (ours[..., 1] != theirs[..., 1])
    elif stage is Stage.DISTANCE:
        misses = np.isinf(ours[..., 0]) != np.isinf(theirs[..., 0])
    finite = bool(np.isfinite(ours).all())
    own, others = (tuple(map(float, image[row, column])) for image in (ours, theirs))
    errors, bounds = (np.atleast_1d(image[row, column]).tolist() for image in (wrong, limit))
    worst_error = _worst_channel(errors, bounds if len(bounds) == len(errors) else bounds * len(errors))
    everywhere = np.ones_like(hit) if stage is Stage.RAY else hit
    return Measurement(
        worst_ratio=float(there),
        worst_error=worst_error,
        limit=float(worst_error / there) if 0 < there < np.inf else float(np.max(limit[row, column])),
        pixel=(column, row),
        ours=own,
        theirs=others,
        interior=int(np.count_nonzero(everywhere & (ratio <= 1))),
        wrong=int(np.count_nonzero(is_wrong)),
        explained=int(np.count_nonzero(excused)),
        hit_miss=int(np.count_nonzero(misses & is_wrong)) if misses is not None else 0,
        nan=0 if finite else int(np.count_nonzero(any_of(np.isnan(ours)))),
        inf=0 if finite else _new_infinities(ours, theirs, left_out),
        ulp=_ulp(own, others, precision),
        mean_wrong=_mean_finite(wrong[is_wrong]) if there > 1 else 0.0,
        kinds=kinds,
    )


def _mean_finite(errors: np.ndarray) -> float:
    """Return the mean of errors, of each pixel's largest channel, without those that are not finite; 0 of none."""
    each = errors if errors.ndim == 1 else errors.max(axis=-1)
    known = each[np.isfinite(each)]
    return float(known.mean()) if known.size else 0.0


def held_to(
    stage: Stage, limit: np.ndarray, theirs: np.ndarray, size: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Return where a limit is more than `WIDE` of the value, and where it is finite at all (height, width).

    `size` is what it is a share of where that is not the value: (height, width).
    """
    bounded = all_of(np.isfinite(limit)) if limit.ndim == 3 else np.isfinite(limit)
    return _wide(stage, limit, theirs, size), bounded


def _wide(stage: Stage, limit: np.ndarray, theirs: np.ndarray, size: np.ndarray | None) -> np.ndarray:
    """Return where a limit is more than `WIDE` of the value, or of `size`, in any channel (height, width)."""
    if stage in DIRECTIONS:
        return limit > WIDE  # rad, of a unit vector
    # A black pixel, or a miss, has no size: the step of a file of floats there, 2^-150, is no wide limit.
    least = np.finfo(np.float32).tiny
    if size is not None or stage is Stage.POSITION:
        return limit > WIDE * np.maximum(length(theirs) if size is None else size, least)
    values = np.maximum(np.abs(theirs), least)
    return any_of((limit if limit.ndim == theirs.ndim else limit[..., np.newaxis]) > WIDE * values)


def _new_infinities(ours: np.ndarray, theirs: np.ndarray, left_out: np.ndarray) -> int:
    """Return how many pixels are infinite where the reference is finite, and neither explained nor unexamined."""
    return int(np.count_nonzero(any_of(np.isinf(ours) & ~np.isinf(theirs)) & ~left_out))


def _ulp(ours: Sequence[float], theirs: Sequence[float], precision: str) -> float:
    """Return one pixel's error in units in the last place of the reference's largest component."""
    if not all(map(math.isfinite, (*ours, *theirs))) or not ours:
        return 0.0 if ours == theirs else math.inf
    size = max(*map(abs, theirs), float(np.finfo(precision).tiny))
    # Python's division: next to a black reference the quotient may overflow, which is an answer and no mishap.
    farthest = max(abs(one - other) for one, other in zip(ours, theirs, strict=True))
    return farthest / float(np.spacing(np.asarray(size, dtype=precision)))
