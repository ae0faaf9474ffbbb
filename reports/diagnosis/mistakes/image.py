"""Right values written wrongly, IMG-1: mirrored, turned, shifted, swapped bytes, undrawn parts.

What is damaged so is foretold from the oracle's own values, pixel by pixel. Of an image that is written from another
corner the camera's formulas tell the same (`camera.py`), unless the rays themselves are in their places.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from rayproof.cases.stages import IMAGE_STAGES, Stage, StageImages
from rayproof.reports.diagnosis import MISTAKES, Answered, Mistake, Stored, Way
from rayproof.reports.diagnosis.answering import Unanswerable
from rayproof.reports.judge.measurement import ratios

NOTHING = -1  # in a map of pixels: none was written there, and nobody knows what the memory held
PADS = (4, 8, 16, 32, 64, 128)  # pixels to multiples of which rows are padded
HALF_LARGEST = 65504.0  # of IEEE 754-2008, binary16
WHOLE = (Stage.OBJECT, Stage.VISIBILITY)


@dataclass(frozen=True, kw_only=True)
class Placed:
    """Pixels in other places: `source` says for each place of the file, (height, width), which pixel lies there."""

    source: Callable[[int, int], np.ndarray]
    empty: bool = False  # where none was written the file has zeros; else nobody knows what

    def __call__(self, right: Answered, _: StageImages) -> Answered:
        """Return the answers as they are written."""
        height, width = right.edge.shape
        source = self.source(height, width)
        lost, flat = source == NOTHING, np.maximum(source, 0)

        def moved(image: np.ndarray) -> np.ndarray:
            return image.reshape(height * width, *image.shape[2:])[flat]

        return replace(
            right,
            answers={
                stage: np.where(lost[..., np.newaxis], 0.0, moved(np.asarray(image)))
                for stage, image in right.answers.items()
            },
            limits={stage: moved(np.asarray(limit)) for stage, limit in right.limits.items()},
            edge=moved(right.edge) & ~lost | (lost & ~np.bool_(self.empty)),
        )


@dataclass(frozen=True, kw_only=True)
class Undrawn:
    """Parts of the image, by its size (height, width), in which nothing was drawn over what the memory held."""

    parts: Mapping[tuple[int, int], np.ndarray] = field(default_factory=dict)
    blank: Mapping[Stage, np.ndarray] = field(default_factory=dict)  # what it held, (channels,)

    def __call__(self, right: Answered, _: StageImages) -> Answered:
        """Return the answers as they are written; raise Unanswerable of a size of which nothing is known."""
        height, width = right.edge.shape
        where = self.parts.get((height, width))
        if self.parts and where is None:
            raise Unanswerable("no image of this size showed what is not drawn")
        if where is None:  # an example: the last quarter of the rows
            where = np.arange(height)[:, np.newaxis] >= np.full((1, width), 3 * height // 4)
        answers = {
            stage: np.where(where[..., np.newaxis], self.blank.get(stage, 0.0), image)
            for stage, image in right.answers.items()
        }
        return replace(right, answers=answers, edge=right.edge & ~where)


def _swapped_bytes(right: Answered, ours: StageImages) -> Answered:
    """Return floats with their bytes in the other order: ours, where they are the right ones turned round again."""
    answers, edge = {}, right.edge.copy()
    for stage, image in right.answers.items():
        written = _turned(image)
        if stage in ours and np.shape(ours[stage]) == np.shape(image):
            mine = np.asarray(ours[stage], dtype=np.float64)
            with np.errstate(all="ignore"):
                agree = ratios(stage, _turned(mine), np.asarray(image, dtype=np.float64), right.limits[stage])[0] <= 1
            # Their last digits, which nobody foretells, lead now.
            written = np.where(agree[..., np.newaxis], mine, written)
        edge |= np.any(np.isnan(written), axis=-1)
        answers[stage] = written
    return replace(right, answers=answers, edge=edge)


def _turned(image: np.ndarray) -> np.ndarray:
    with np.errstate(all="ignore"):
        return np.asarray(image, dtype=np.float32).byteswap().astype(np.float64)


def _halved(*, largest: float) -> Stored:
    """Return the writer of 16-bit floats; what is larger than they hold becomes `largest`."""

    def half(value: np.ndarray) -> np.ndarray:
        with np.errstate(all="ignore"):
            found = np.asarray(value, dtype=np.float64).astype(np.float16).astype(np.float64)
        over = np.isinf(found) & np.isfinite(value)
        return np.where(over, np.copysign(largest, value), found)

    def stored(right: Answered, _: StageImages) -> Answered:
        answers, bounds = {}, {}
        for stage, image in right.answers.items():
            limit = np.asarray(right.limits[stage])
            answers[stage] = half(image)
            if stage in WHOLE:
                bounds[stage] = limit
                continue
            apart = limit if limit.ndim == 3 else np.repeat(limit[..., np.newaxis], image.shape[-1], axis=-1)
            with np.errstate(all="ignore"):
                ends = [np.abs(half(image + sign * apart) - answers[stage]) for sign in (-1, 1)]
                moved = np.nan_to_num(np.maximum(*ends), nan=0.0, posinf=np.inf)
            bounds[stage] = (moved if limit.ndim == 3 else np.linalg.norm(moved, axis=-1)) + limit * 1e-3
        return replace(right, answers=answers, limits=bounds)

    return stored


@dataclass(frozen=True, kw_only=True)
class InSomeStages:
    """A writer that writes some stages so, and the others as they are."""

    stored: Stored
    stages: frozenset[Stage]

    def __call__(self, right: Answered, ours: StageImages) -> Answered:
        """Return the answers as they are written."""
        found = self.stored(right, ours)
        return replace(
            right,
            answers={stage: (found if stage in self.stages else right).answers[stage] for stage in right.answers},
            limits={stage: (found if stage in self.stages else right).limits[stage] for stage in right.answers},
            edge=right.edge | found.edge if self.stages < set(right.answers) & set(IMAGE_STAGES) else found.edge,
        )


def _places(height: int, width: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return each place's number in the file, its row and its column, each (height, width)."""
    rows, columns = np.indices((height, width))
    return rows * width + columns, rows, columns


def _mirrored(height: int, width: int) -> np.ndarray:
    return _places(height, width)[0][:, ::-1]


def _upside_down(height: int, width: int) -> np.ndarray:
    return _places(height, width)[0][::-1]


def _turned_half(height: int, width: int) -> np.ndarray:
    return _places(height, width)[0][::-1, ::-1]


def _columns_first(height: int, width: int) -> np.ndarray:
    place, _, _ = _places(height, width)
    return place % height * width + place // height


def _read_by_columns(height: int, width: int) -> np.ndarray:
    place, _, _ = _places(height, width)
    return place % width * height + place // width


def _moved(by: Callable[[int], int], *, around: bool) -> Callable[[int, int], np.ndarray]:
    """Return the map of images each of whose pixels lies so many places too late; `by` knows the width.

    What leaves the image at one end comes in at the other, if it is moved `around`.
    """

    def source(height: int, width: int) -> np.ndarray:
        found = _places(height, width)[0] - by(width)
        if around:
            return found % (height * width)
        return np.where((found >= 0) & (found < height * width), found, NOTHING)

    return source


Stride = Callable[[int, int], int]  # the distance between rows in memory [pixels], of a height and a width


def _written_by(stride: Stride) -> Callable[[int, int], np.ndarray]:
    """Return the map of rows that are written so far apart and read as if they were the width apart; later rows win."""

    def source(height: int, width: int) -> np.ndarray:
        apart = stride(height, width)
        place, _, columns = _places(height, width)
        found = np.full(height * width, NOTHING)
        for row in range(height):
            there = row * apart + columns[0]
            inside = there < height * width
            found[there[inside]] = place[row][inside]
        return found.reshape(height, width)

    return source


def _read_by(stride: Stride) -> Callable[[int, int], np.ndarray]:
    """Return the map of rows that are written the width apart and read as if they were so far apart."""

    def source(height: int, width: int) -> np.ndarray:
        _, rows, columns = _places(height, width)
        found = rows * stride(height, width) + columns
        return np.where(found < height * width, found, NOTHING)

    return source


def _padded(to: int) -> Stride:
    return lambda _, width: -(-width // to) * to


STRIDES: tuple[Stride, ...] = (
    lambda height, _: height,
    *(_padded(to) for to in PADS),
    lambda _, width: width + 1,
    lambda _, width: width - 1,
    lambda _, width: width + 2,
)


def _register(name: str, says: str, *stored: Stored) -> None:
    MISTAKES.register(name)(Mistake(says=says, items=("IMG-1",), ways=tuple(Way(stored=one) for one in stored)))


def _register_moved(name: str, says: str, *sources: Callable[[int, int], np.ndarray]) -> None:
    _register(name, says, *(Placed(source=source) for source in sources))


_register_moved("stages_mirrored", "writes some stages with each row from right to left, others rightly", _mirrored)
_register_moved("stages_upside_down", "writes some stages with the bottom row first, others rightly", _upside_down)
_register_moved("stages_turned_half", "writes some stages turned by 180 degrees, others rightly", _turned_half)
_register_moved("columns_first", "writes its image column by column", _columns_first, _read_by_columns)
_register_moved(
    "row_stride",
    "takes another distance between its image's rows in memory than there is",
    *(_written_by(stride) for stride in STRIDES),
    *(_read_by(stride) for stride in STRIDES),
)
_register(
    "one_place_off",
    "writes each pixel of its image one place too early or too late",
    *(
        Placed(source=_moved(by, around=around), empty=not around)
        for by in (lambda _: 1, lambda _: -1, lambda width: width, lambda width: -width)
        for around in (False, True)
    ),
)
_register("undrawn", "leaves whole strips or tiles of its images undrawn", Undrawn())
_register("bytes_swapped", "writes the bytes of its floats in the other order", _swapped_bytes)
_register(
    "half_floats",
    "writes 16-bit floats, of which what is larger than 65504 is none",
    _halved(largest=np.inf),
    _halved(largest=HALF_LARGEST),
)
