"""Long slanting triangles in parts, each part with a box of its own, before a tree is built over them.

The box about a sliver from pole to pole is as large as the ball, and every ray that meets the box tries the sliver. The
boxes about its two halves have a quarter of that volume each. A part keeps its triangle's number, and the formula is
asked about the whole triangle: a hit is the same by whichever part it is found, and the same hit when it is found
twice. The boxes that gain most area are halved, at planes of a grid that all triangles share, so that the parts of
neighbours end at the same places.
Sources: Ernst and Greiner, "Early Split Clipping for Bounding Volume Hierarchies", IEEE Symposium on Interactive Ray
Tracing (2007); Karras and Aila, "Fast Parallel Construction of High-Quality Bounding Volume Hierarchies", High
Performance Graphics (2013), section 4.3.

No hit is lost. The default formula decides by signs that are right for sheared corners, and a corner is sheared by
operations that move it, on either axis across the ray, by at most 4 u (abs(corner - origin) + size), where u is the
unit roundoff and `size` the longest side of the box about all triangles. So the point that it reports lies as close to
some point of the triangle, which is in a part. A box reaches 16 u size beyond its part, and 2 u times the largest
coordinate, since it is kept in float32; what grows with the distance is what a beam allows for when it meets boxes
(`tracer.acceleration.packet_bounds`), of whole triangles too.
"""

import numpy as np

from rayproof.cases.rounding import UNIT_ROUNDOFF
from rayproof.tracer.shapes.triangles import in_pieces, shadows

FEWEST = 64  # triangles; of fewer none is cut: a tree of so few is soon walked
# How much larger the boxes are than the triangles' shadows on their sides, from which on parts pay. Smooth meshes have
# 2.6 and become slower by parts, rods in all directions have 181.
SLANTING = 8.0
FALLS = 2 / 3  # of the boxes' area that twice as many parts leave at most, or there are no more
MOST = 16  # parts for a triangle, on average
MOST_PARTS = 2**19  # in all; a tree must be there soon
ROUNDS = 2  # in which parts become twice as many, so that what was halved may be halved again
# What a box reaches beyond its part: of the size of all boxes together, and of the largest coordinate.
BESIDE, ROUNDED = 16 * UNIT_ROUNDOFF["float32"], 2 * UNIT_ROUNDOFF["float32"]


def _half_areas(lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
    """Return half the surface of boxes (3, n) [m^2]."""
    x, y, z = (upper - lower).astype(np.float64)
    return x * y + y * z + z * x


def slant(corners: np.ndarray) -> float:
    """Return half the area of all triangles' boxes over that of their shadows; triangles are rows of nine numbers."""
    sums: list[tuple[float, float]] = []

    def work(piece: slice) -> None:
        taken = corners[piece].T.astype(np.float64).reshape(3, 3, -1)
        boxes = _half_areas(taken.min(axis=0), taken.max(axis=0))
        sums.append((float(boxes.sum()), float(shadows(taken).sum())))

    in_pieces(len(corners), work)
    boxes, shade = (sum(some) for some in zip(*sums, strict=True))
    return boxes / shade if shade > 0 else 1.0


def _room(count: int) -> int:
    """Return how many parts there may be of so many triangles: a power of two, as a tree has leaves."""
    return 2 ** (min(MOST * count, MOST_PARTS).bit_length() - 1)


def slanting(corners: np.ndarray) -> bool:
    """Return whether triangles, rows of nine numbers, are to be cut into parts."""
    count = len(corners)
    return count >= FEWEST and _room(count) >= 2 * count and slant(corners) >= SLANTING


def _planes(lower: np.ndarray, upper: np.ndarray, base: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return each box's longest axis, and the plane of the common grid across it that is nearest to its middle."""
    axis = np.argmax(upper - lower, axis=0)
    at = axis, np.arange(len(axis))
    low, high, origin = lower[at], upper[at], base[axis]
    # As far apart as a quarter to a half of the box is long: the nearest to its middle is in its middle half.
    apart = np.exp2(np.floor(np.log2(high - low)) - 1)
    return axis, origin + apart * np.round(((low + high) / 2 - origin) / apart)


def _halves(
    corners: np.ndarray, lower: np.ndarray, upper: np.ndarray, *, base: np.ndarray, margin: float
) -> np.ndarray:
    """Return the boxes of the two halves of each part, (half, lower or upper corner, 3, n) [m].

    A part is what of a triangle, `corners` (3, 3, n), lies in its box (3, n); of the triangle before the plane and
    behind it, that box keeps what the part has there.
    """
    axis, plane = _planes(lower, upper, base)
    along = np.take_along_axis(corners, axis[np.newaxis, np.newaxis], axis=1)[:, 0]
    # Upper corners are negated, so that all that follows is a minimum.
    found = np.full((2, 2, 3, len(axis)), np.inf)

    def add(point: np.ndarray, where: tuple[np.ndarray, np.ndarray]) -> None:
        for (low, high), there in zip(found, where, strict=True):
            np.minimum(low, point, out=low, where=there)
            np.minimum(high, -point, out=high, where=there)

    for corner, at in zip(corners, along, strict=True):
        add(corner, (at <= plane, at >= plane))
    for first, second in ((0, 1), (1, 2), (2, 0)):
        crosses = (along[first] < plane) != (along[second] < plane)
        share = (plane - along[first]) / np.where(crosses, along[second] - along[first], 1.0)
        add(corners[first] + share * (corners[second] - corners[first]), (crosses, crosses))
    found[:, 0] = np.maximum(found[:, 0] - margin, lower)
    found[:, 1] = np.minimum(margin - found[:, 1], upper)
    return found


class _Growing:
    """Parts that become more: their boxes, and those of the halves that each would have."""

    def __init__(self, corners: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> None:
        """Begin with whole triangles, rows of nine numbers, and their boxes (3, n) [m]."""
        self._corners, self.count = corners, len(corners)
        self.room = _room(self.count)
        self._base = lower.min(axis=1).astype(np.float64)
        end = upper.max(axis=1).astype(np.float64)
        largest = np.maximum(abs(self._base), abs(end)).max()
        self._margin = float((end - self._base).max() * BESIDE + largest * ROUNDED)
        self._owner = np.empty(self.room, dtype=np.int32)
        self._boxes = np.empty((2, 3, self.room), dtype=np.float32)
        self._split = np.empty((2, 2, 3, self.room), dtype=np.float32)
        self._gains = np.empty(self.room)  # half the area that is gained by halving [m^2]
        self._owner[: self.count] = np.arange(self.count)
        self._boxes[0, :, : self.count], self._boxes[1, :, : self.count] = lower, upper
        self._prepare(np.arange(self.count))

    @property
    def parts(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return lower and upper corners, (3, parts) float32 [m], and the number of each part's triangle."""
        lower, upper = self._boxes[..., : self.count]
        return lower, upper, self._owner[: self.count]

    @property
    def area(self) -> float:
        """Return half the area of all boxes [m^2]."""
        return float(_half_areas(*self._boxes[..., : self.count]).sum())

    def _prepare(self, parts: np.ndarray) -> None:
        """Find the halves of these parts, and what is gained by them."""

        def work(piece: slice) -> None:
            some = parts[piece]
            corners = self._corners[self._owner[some]].T.astype(np.float64).reshape(3, 3, -1)
            lower, upper = self._boxes[..., some].astype(np.float64)
            # Near the margin a plane may have nothing of the triangle on one of its sides.
            large = (upper - lower).max(axis=0) > 16 * self._margin
            some, corners, lower, upper = some[large], corners[..., large], lower[:, large], upper[:, large]
            halves = _halves(corners, lower, upper, base=self._base, margin=self._margin)
            self._gains[parts[piece]] = 0.0
            self._gains[some] = _half_areas(lower, upper) - sum(_half_areas(*half) for half in halves)
            self._split[..., some] = halves

        in_pieces(len(parts), work)

    def grow(self, count: int) -> None:
        """Halve the parts by which most is gained, until there are `count`, at most twice as many as there were."""
        gains = self._gains[: self.count]
        kept = 2 * self.count - count
        chosen = np.argpartition(gains, kept)[kept:] if kept else np.arange(self.count)
        chosen = chosen[gains[chosen] > 0]
        new = np.arange(self.count, self.count + len(chosen))
        self._owner[new] = self._owner[chosen]
        self._boxes[..., chosen], self._boxes[..., new] = self._split[0][..., chosen], self._split[1][..., chosen]
        self.count += len(chosen)
        if self.count < self.room:
            self._prepare(np.concatenate([chosen, new]))


def in_parts(corners: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Cut triangles, rows of nine numbers with boxes (3, n) [m], into as many parts as pay.

    Returns:
        Lower and upper corners of the parts' boxes, (3, parts) float32 [m], and the number of each part's triangle,
        (parts,) int32.

    """
    growing = _Growing(corners, lower, upper)
    target = growing.room
    while target > 3 * len(corners):
        target //= 2
    while target <= growing.room:
        area, factor = growing.area, target / growing.count
        for left in range(ROUNDS, 0, -1):
            growing.grow(min(round(growing.count * (target / growing.count) ** (1 / left)), 2 * growing.count))
        if growing.area > area * FALLS ** np.log2(factor):
            break
        target *= 2
    return growing.parts
