"""The ledger of what a check examined: what became of every pixel, or of every entry of the camera, none left out."""

from dataclasses import asdict, dataclass, fields
from enum import IntEnum

import numpy as np

from rayproof.cases.scene import Camera
from rayproof.cases.stages import Stage

# A limit above this share of the value holds a pixel to so little that it is counted apart.
WIDE = 0.01
# Of a case's pixels this share, and at least one pixel, may be held to an interval.
INTERVALS = 0.001
# The camera's answer: four matrices, eight corners, and two numbers a pixel each for pixel and NDC.
MATRIX_ENTRIES, CORNER_ENTRIES, ENTRIES_PER_PIXEL = 4 * 16, 8 * 3, 2 * 2


class Kind(IntEnum):
    """What became of one pixel."""

    STRICT = 0  # away from edges, held to a limit of at most 1 % of the value
    WIDE = 1  # likewise, but the limit is more than 1 % of the value
    SIDE = 2  # at an edge, and equal to one of its sides
    INTERVAL = 3  # at an edge whose sides are too many to list or have no bound: within what they span
    EPSILON = 4  # excused by nothing but a party's own epsilon, and equal to a side
    WRONG = 5  # over its limit
    UNEXAMINED = 6  # held to nothing: never measured, or the limit is not finite


@dataclass(frozen=True, kw_only=True)
class Examined:
    """How many pixels of each kind a check has.

    Raises:
        ValueError: the kinds do not add up to the pixels; one was lost or counted twice.

    """

    pixels: int
    strict: int = 0
    wide: int = 0
    side: int = 0
    interval: int = 0
    epsilon: int = 0
    wrong: int = 0
    unexamined: int = 0

    def __post_init__(self) -> None:
        """Raise ValueError unless the ledger adds up."""
        counts = [getattr(self, kind.name.lower()) for kind in Kind]
        if sum(counts) != self.pixels or min(counts) < 0:
            raise ValueError(f"{self.pixels} pixels, but the ledger of what was examined has {counts}")

    def __add__(self, other: "Examined") -> "Examined":
        """Return both ledgers as one."""
        return Examined(**{each.name: getattr(self, each.name) + getattr(other, each.name) for each in fields(self)})

    def as_json(self) -> dict[str, int]:
        """Return plain JSON data."""
        return asdict(self)


def counted(kinds: np.ndarray) -> Examined:
    """Return the ledger of pixels, each a `Kind`; of any shape."""
    counts = np.bincount(kinds.ravel(), minlength=len(Kind)).tolist()
    return Examined(pixels=kinds.size, **{kind.name.lower(): counts[kind] for kind in Kind})


def unexamined(stage: Stage, camera: Camera) -> Examined:
    """Return the ledger of a check that ended before anything was measured."""
    pixels = camera.width * camera.height
    if stage is Stage.CAMERA:
        pixels = MATRIX_ENTRIES + CORNER_ENTRIES + ENTRIES_PER_PIXEL * pixels
    return Examined(pixels=pixels, unexamined=pixels)


def most_interval(pixels: int) -> int:
    """Return how many of a check's pixels may be held to an interval only."""
    return max(1, int(INTERVALS * pixels))


def kinds_of(
    ratio: np.ndarray,
    forgiven: np.ndarray,
    *,
    wide: np.ndarray,
    bounded: np.ndarray,
    edge: np.ndarray,
    interval: np.ndarray | None,
    window: np.ndarray | None,
) -> np.ndarray:
    """Return each pixel's kind, uint8 (height, width).

    `ratio` is error over limit, `forgiven` the edge pixels that have a side's value; `wide` and `bounded` say of the
    limit that it is above 1 % of the value and that it is finite; `interval` are the edge pixels of which the sides
    only span an interval, `window` those that only a party's epsilon leaves undecided.
    """
    kinds = np.where(edge, np.uint8(Kind.SIDE), wide.astype(np.uint8))
    over = ~(ratio <= 1)
    if over.any():
        excused = over & forgiven
        if window is not None:
            kinds[excused & window] = Kind.EPSILON
        if interval is not None:
            kinds[excused & interval] = Kind.INTERVAL
        kinds[over & ~forgiven] = Kind.WRONG
    if not bounded.all():
        kinds[~bounded & ~over] = Kind.UNEXAMINED
    return kinds
