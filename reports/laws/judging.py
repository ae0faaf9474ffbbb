"""One relation judged: how many of its values lie within the limit, at an edge, or outside."""

from dataclasses import dataclass

import numpy as np

from rayproof.cases.laws.relations import Relation
from rayproof.cases.stages import Resolution, Stage
from rayproof.reports.laws.limits import TELLING, WHOLE, limit, neighbours, roundoff

BEND = 0.5  # of a step from pixel to pixel: where an image bends by more, an edge runs between the two
MOST_EXCUSED = 0.02  # share of the pixels examined that rounding may move over an edge
ALWAYS = 8  # pixels that it may in any image: an edge that runs along a short row


@dataclass(frozen=True, kw_only=True)
class Judged:
    """What became of a relation."""

    stage: Stage
    what: str
    examined: int  # pixels
    excused: int  # of these, at an edge, with the value of a neighbour
    outside: int  # of these, with a value that nothing explains
    worst: float  # largest error over K u (size + pixels per radian x range), edges left out
    pixel: tuple[int, int] | None  # column and row of the worst pixel outside
    expected: tuple[float, ...] = ()  # there
    measured: tuple[float, ...] = ()
    ill_conditioned: bool = False  # the limit is too wide to tell anything

    @property
    def alarm(self) -> bool:
        """Say whether the law is broken."""
        return self.outside > 0 or self.excused > max(ALWAYS, MOST_EXCUSED * self.examined)


def judge(relation: Relation, precision: str, coarse: Resolution | None = None) -> Judged:
    """Return what becomes of a relation of images that `precision` computed and an output may have made coarse."""
    expected, measured = relation.expected, relation.measured
    if expected.shape != measured.shape:
        return _misshapen(relation)
    wide = not relation.conditions.exact and roundoff(relation, precision) > TELLING
    if wide and relation.stage not in WHOLE:
        return Judged(
            stage=relation.stage, what=relation.what, examined=0, excused=0, outside=0, worst=0.0, pixel=None,
            ill_conditioned=True,
        )  # fmt: skip
    allowed = limit(relation, precision, coarse)
    error = difference(expected, measured)
    pixels = np.ones(expected.shape[:2], dtype=bool) if relation.examined is None else relation.examined
    beyond = np.any(~(error <= allowed), axis=-1) & pixels
    smooth = relation.stage in (Stage.CAMERA, Stage.RAY)
    excused = np.zeros_like(beyond) if smooth or not beyond.any() else beyond & _at_an_edge(relation, allowed)
    outside = beyond & ~excused
    ratio = ratios(relation, precision, coarse)
    ratio = np.where((pixels & ~excused)[..., np.newaxis], ratio, 0.0)
    row, column = np.unravel_index(int(np.argmax(np.where(outside, ratio.max(axis=-1), -1.0))), outside.shape)
    bad = bool(outside.any())
    return Judged(
        stage=relation.stage,
        what=relation.what,
        examined=int(pixels.sum()),
        excused=int(excused.sum()),
        outside=int(outside.sum()),
        worst=float(ratio.max(initial=0.0)),
        pixel=(int(column), int(row)) if bad else None,
        expected=tuple(map(float, expected[row, column])) if bad else (),
        measured=tuple(map(float, measured[row, column])) if bad else (),
    )


def _misshapen(relation: Relation) -> Judged:
    count = int(np.prod(relation.expected.shape[:2]))
    return Judged(
        stage=relation.stage, what=relation.what, examined=count, excused=0, outside=count, worst=np.inf, pixel=None
    )  # fmt: skip


def ratios(relation: Relation, precision: str, coarse: Resolution | None = None) -> np.ndarray:
    """Return error over limit, in the shape of a relation's images; 0 where there is no error, whatever the limit."""
    allowed = limit(relation, precision, coarse)
    error = difference(relation.expected, relation.measured)
    return np.divide(error, allowed, out=np.where(error > 0, np.inf, 0.0), where=allowed > 0)


def difference(expected: np.ndarray, measured: np.ndarray) -> np.ndarray:
    """Return |expected - measured|: 0 where both are the same infinity, infinite where either is NaN."""
    with np.errstate(invalid="ignore"):
        apart = np.abs(expected - measured)
    return np.where(expected == measured, 0.0, np.where(np.isnan(apart), np.inf, apart))


def _at_an_edge(relation: Relation, allowed: np.ndarray) -> np.ndarray:
    """Return where (height, width) an edge runs close by and the measured value is one from beyond it.

    At an edge the expected image bends: what it gains in one direction it does not lose in the other. The value beyond
    is a neighbour's, less at most what separates that one from the next pixel on the same line.
    """
    image, value = (np.where(np.isfinite(one), one, np.nan) for one in (relation.expected, relation.measured))
    # A distance is infinite where nothing is hit; nothing else ever is, and NaN is nobody's value.
    broken = np.isnan(relation.expected) | np.isnan(relation.measured)
    if relation.stage is not Stage.DISTANCE:
        broken |= np.isinf(relation.expected) | np.isinf(relation.measured)
    around = neighbours(image)
    further = np.stack([neighbours(one)[index] for index, one in enumerate(around)])
    with np.errstate(invalid="ignore"):
        steps = np.linalg.norm(around - image, axis=-1).max(axis=0)
        bends = np.linalg.norm(around + around[::-1] - 2 * image, axis=-1).max(axis=0)
        beyond = np.all(np.abs(value - around) <= np.abs(around - further) + 2 * allowed, axis=-1).any(axis=0)
    empty = np.isnan(around).any(axis=-1).any(axis=0)  # a miss is next to it
    missed, gone = np.isnan(image).any(axis=-1), np.isnan(value).any(axis=-1)
    return np.where(gone, empty, ((bends > BEND * steps) | empty | missed) & beyond) & ~broken.any(axis=-1)
