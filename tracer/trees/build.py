"""Construction of a tree by the surface area heuristic, with early split clipping of long oblique triangles.

A tree is built over boxes on a grid; each of its nodes is cut where the expected number of hits is least (`cheapest`).

Of the cuts across the long axes of a node, the cheapest is taken that leaves neither side more items than its leaves
can hold. This does not improve a very large tree: each of its nodes is halved across its longest axis, and its items
fill all slots. All leaves are on one level, as in a binary heap. Several threads build pieces of the tree: level by
level, all nodes of a level at once. The items are sorted along each axis at the start of the piece.

The probability that a ray which hits a box also hits a box inside it is the ratio of their areas. A cut of n items into
k and n - k costs k times the area of the first box and n - k times that of the second. Of very many cuts only some are
compared, and of many items between two of them a sample is used.
Source: MacDonald and Booth, "Heuristics for ray tracing using space subdivision", The Visual Computer 6 (1990); Wald,
"On fast Construction of SAH-based Bounding Volume Hierarchies", IEEE Symposium on Interactive Ray Tracing (2007).

Long oblique triangles are split into parts with a box each before a tree is built over them.

The box about a sliver from pole to pole of a ball is as large as the ball, and every ray that hits the box tests the
sliver. The boxes about its two halves have a quarter of that volume each. A part has its triangle's number, and the
formula tests the whole triangle: the hit does not depend on the part, and a triangle that is tested twice gives the
same hit. The boxes with the largest gain of area are halved, at planes of a grid that all triangles share, so that the
parts of neighbours end at the same places.
Sources: Ernst and Greiner, "Early Split Clipping for Bounding Volume Hierarchies", IEEE Symposium on Interactive Ray
Tracing (2007); Karras and Aila, "Fast Parallel Construction of High-Quality Bounding Volume Hierarchies", High
Performance Graphics (2013), section 4.3.

No hit is lost. The default formula decides by signs that are right for sheared corners, and the shear moves a corner,
on either axis across the ray, by at most 4 u (abs(corner - origin) + size), where u is the unit roundoff and `size` the
longest side of the box about all triangles. So the reported point is that close to some point of the triangle, which is
in a part. A box extends beyond its part by 16 u size, and by 2 u times the largest coordinate because it is stored in
float32; the box test of a beam (`tracer.trees.beams`) covers the term that grows with the distance, for whole triangles
too.
"""

import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property
from itertools import repeat

import numpy as np

from rayproof.cases.rounding import UNIT_ROUNDOFF
from rayproof.tracer.shapes.meshes import in_pieces, shadows
from rayproof.tracer.trees.boxes import AXES, LOWER, ROW, STEPS, UPPER, GridBoxes, Tree

MOST_LEAVES = 2**21  # limited by the bits of a traversal's trail; a larger tree has larger leaves
MOST_BY_AREA = 2**19  # items; with 1.3 million items as small as pixels, halving built sooner and traced as fast
PIECE = (
    2**15
)  # leaves of the largest tree that is built in one piece, and the size of the sample for halving larger trees
PIECES = 4  # times PIECE: the leaves of each piece of a larger tree; in smaller ones threads wait for the interpreter
CUTS, CUTS_IN_PIECES = 32, 16  # compared cuts along an axis: in a tree of one piece, and in pieces
LONG = 0.4  # the least ratio of an axis to the node's longest one for a cut across it; smaller ratios lose no area
FEW = 2  # the largest number of items that get a leaf each without a cut
THREADS = min(8, os.cpu_count() or 1)  # numpy's long operations release the interpreter lock


@dataclass(frozen=True, kw_only=True)
class _Part:
    """A node of a tree that is cut by itself."""

    number: int  # in its level
    items: np.ndarray  # (n,) int32
    rows: np.ndarray  # (n, ROW) uint16, their boxes


def _middles(rows: np.ndarray, axis: int) -> np.ndarray:
    """Return the middles of boxes along an axis in grid steps, rounded down, (n,) uint16."""
    return ((rows[:, LOWER + axis].astype(np.uint32) + STEPS - rows[:, UPPER + axis]) >> 1).astype(np.uint16)


@dataclass(frozen=True, kw_only=True)
class _Nodes:
    """Nodes of one level that have items."""

    rows: np.ndarray  # (n, ROW) uint16, the boxes of a piece's items
    order: np.ndarray  # (AXES, places) intp, their items by the middles of the boxes along each axis, node by node
    number: np.ndarray  # (nodes,) int64, from 0 for the first of the level
    counts: np.ndarray  # (nodes,) int64, items of each

    @classmethod
    def alone(cls, number: int, rows: np.ndarray) -> "_Nodes":
        """Return one node with these items."""
        order = np.stack([np.argsort(_middles(rows, axis), kind="stable") for axis in range(AXES)])
        return cls(rows=rows, order=order, number=np.array([number]), counts=np.array([len(rows)]))

    @cached_property
    def first(self) -> np.ndarray:
        """Return the position of each node's first item."""
        return np.cumsum(self.counts) - self.counts

    def extents(self, step: np.ndarray) -> np.ndarray:
        """Return the extent along each axis of the middles of each node's items, (AXES, nodes)."""
        ends = ROW * self.order[:, np.stack([self.first, self.first + self.counts - 1])]
        words, axes = self.rows.reshape(-1), np.arange(AXES)[:, np.newaxis, np.newaxis]
        middles = words.take(ends + LOWER + axes).astype(np.float32) - words.take(ends + UPPER + axes)
        return (middles[:, 1] - middles[:, 0]) * step[:, np.newaxis]

    def cut(self, axis: np.ndarray, before: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return all children's numbers and counts, and their items, child by child; the first child gets `before`."""
        places = self.order.shape[1]
        items = self.order.reshape(-1).take(np.arange(places) + np.repeat(places * axis, self.counts))
        counts = np.stack([before, self.counts - before], axis=1).reshape(-1)
        return (2 * self.number[:, np.newaxis] + np.arange(2)).reshape(-1), counts, items

    def children(self, number: np.ndarray, counts: np.ndarray, items: np.ndarray, kept: np.ndarray) -> "_Nodes":
        """Return the `kept` children."""
        side = np.where(kept, np.tile(np.array([1, 2], dtype=np.uint8), len(self.counts)), 0)
        sides = np.empty(len(self.rows), dtype=np.uint8)  # of items: in a first child, in a second one, or in none
        sides[items] = np.repeat(side, counts)
        number, counts, is_first = number[kept], counts[kept], side[kept] == 1
        goes = np.repeat(is_first, counts)
        to_first, to_second = np.flatnonzero(goes), np.flatnonzero(~goes)
        order = np.empty((AXES, len(goes)), dtype=np.intp)
        for old, new in zip(self.order, order, strict=True):
            of = sides.take(old)
            new[to_first], new[to_second] = np.compress(of == 1, old), np.compress(of == 2, old)
        return _Nodes(rows=self.rows, order=order, number=number, counts=counts)


class _Growing:
    """A tree that is being built."""

    def __init__(self, boxes: GridBoxes) -> None:
        count = len(boxes.rows)
        self.leaves = min(MOST_LEAVES, 1 << (count - 1).bit_length())
        self._by_area = count <= min(MOST_BY_AREA, self.leaves)
        self._step = (boxes.step / boxes.step.max()).astype(np.float32)
        self.total = self.leaves if self._by_area else count
        self.size = -(-self.total // self.leaves)
        self.slots = np.zeros(self.total + self.size - 1, dtype=np.int32)
        self.empty = np.ones(self.leaves, dtype=bool)

    def _cuts(self, nodes: _Nodes, leaves: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the axis of each node's cut and the number of items in its first child; nodes have `leaves` leaves."""
        extents = nodes.extents(self._step)
        longest = extents.argmax(axis=0)
        if not self._by_area:
            return longest, self._first(leaves * nodes.number + leaves // 2) - self._first(leaves * nodes.number)
        axis, node = np.nonzero(extents >= LONG * extents[longest, np.arange(len(longest))])
        place = nodes.first[node] + axis * nodes.order.shape[1]
        cuts = cheapest(
            nodes.rows,
            nodes.order.reshape(-1),
            place,
            nodes.counts[node],
            room=leaves // 2,
            cuts=CUTS if self.leaves <= PIECE else CUTS_IN_PIECES,
            step=self._step,
        )
        costs, before = np.full(extents.shape, NEVER), np.empty(extents.shape, dtype=np.int64)
        costs[axis, node], before[axis, node] = cuts
        best = np.where(costs.min(axis=0) < NEVER, costs.argmin(axis=0), longest)
        return best, before[best, np.arange(len(best))]

    def _first(self, leaf: np.ndarray) -> np.ndarray:
        return leaf * self.total // self.leaves

    def _put(self, items: np.ndarray, number: np.ndarray, counts: np.ndarray, first: np.ndarray, leaves: int) -> None:
        """Write the items of nodes, from `items[first]` on, into slots; a node of several leaves fills first slots."""
        for place in range(int(counts.max(initial=0))):
            has_item = counts > place
            leaf = number[has_item] * leaves + place * (leaves // 2)
            self.slots[self._first(leaf) + (place if leaves == 1 else 0)] = items[first[has_item] + place]
            self.empty[leaf] = False

    def halves(self, part: _Part, leaves: int) -> list[_Part]:
        """Cut a node of `leaves` leaves, at the cut found for a sample of PIECE of its items."""
        count, room, every = len(part.items), leaves // 2, leaves // PIECE
        nodes = _Nodes.alone(part.number, np.ascontiguousarray(part.rows[::every]))
        (axis,), (before,) = self._cuts(nodes, PIECE if self._by_area else leaves)
        if self._by_area:
            before = min(max(every * before, count - room), room, count)
        # Items with equal middles keep their order.
        words = _middles(part.rows, axis).astype(np.uint64) << 32 | np.arange(count, dtype=np.uint64)
        goes_first = words <= np.partition(words, before - 1)[before - 1]
        sides = np.flatnonzero(goes_first), np.flatnonzero(~goes_first)
        return [
            _Part(number=2 * part.number + k, items=part.items.take(side), rows=part.rows.take(side, axis=0))
            for k, side in enumerate(sides)
            if len(side)
        ]

    def fill(self, part: _Part, leaves: int) -> None:
        """Put the items of a node of `leaves` leaves into slots."""
        nodes = _Nodes.alone(part.number, part.rows)
        if leaves == 1:
            self._put(part.items, nodes.number, nodes.counts, nodes.first, 1)
        while leaves > 1:
            number, counts, chosen = nodes.cut(*self._cuts(nodes, leaves))
            leaves //= 2
            first = np.cumsum(counts) - counts
            done = (counts <= (FEW if self._by_area else 0)) | (leaves == 1)
            self._put(part.items[chosen], number[done], counts[done], first[done], leaves)
            if done.all():
                return
            nodes = nodes.children(number, counts, chosen, ~done)


def tree_over(boxes: GridBoxes) -> Tree:
    """Return a tree over boxes.

    Raises:
        RuntimeError: an item is in no leaf, which is a mistake of this file.

    """
    growing = _Growing(boxes)
    # Items with equal coordinates along an axis keep this order, so that a column of a grid is cut at one place.
    items = np.lexsort([_middles(boxes.rows, axis) for axis in (2, 1, 0)]).astype(np.int32)
    parts = [_Part(number=0, items=items, rows=boxes.rows.take(items, axis=0))]
    leaves = growing.leaves
    piece = leaves if leaves <= PIECE else min(leaves // 2, PIECES * PIECE)
    with ThreadPoolExecutor(THREADS) as pool:
        while leaves > piece:
            parts = [half for two in pool.map(growing.halves, parts, repeat(leaves)) for half in two]
            leaves //= 2
        list(pool.map(growing.fill, parts, repeat(leaves)))
    # No image would certainly reveal that one item in thirty thousand is lost: most items are visible in no pixel.
    held = np.zeros(len(items), dtype=bool)
    held[growing.slots[~growing.empty] if len(growing.slots) == growing.leaves else growing.slots] = True
    if not held.all():
        raise RuntimeError(f"the tree is broken: {np.count_nonzero(~held)} of {len(held)} items stand in no leaf")
    growing.slots.setflags(write=False)
    return Tree(leaves=growing.leaves, size=growing.size, total=growing.total, slots=growing.slots, empty=growing.empty)


SAMPLE = 16  # the number of sampled items between two cuts
MOST_CUTS = 32  # along an axis; the lower bits of a cost are its number
NEVER = np.uint32(0xFFFFFFFF)  # the cost of a cut that is not allowed


def _areas(rows: np.ndarray, step: np.ndarray) -> np.ndarray:
    """Return half the area of boxes (..., ROW), in steps of the longest axis, float32."""
    # The words of both corners are added four at once: no sum is above STEPS, since no box is inside out.
    corners = rows.view(np.uint64)
    extents = (~(corners[..., 0] + corners[..., 1])).view(np.uint16).reshape(*rows.shape[:-1], ROW // 2)
    x, y, z = (extents[..., axis].astype(np.float32) * step[axis] for axis in range(AXES))
    return x * y + y * z + z * x


def cheapest(
    rows: np.ndarray,
    order: np.ndarray,
    first: np.ndarray,
    counts: np.ndarray,
    *,
    room: int,
    cuts: int,
    step: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Return the cost of the best cut of each row of items, and the number of items before it, (n,) each.

    Row i has `counts[i]` items in the order that begins at `order[first[i]]`; no side may have more than `room` items.
    At most `cuts` cuts are compared; `room` and `cuts` are powers of two. Costs are uint32 numbers that compare like
    floats; the cost is NEVER if no cut is allowed, and all items come before it.
    """
    apart = max(1, room // cuts)  # items from cut to cut
    skip = max(1, apart // SAMPLE)
    most, last = int(counts.max()), first + counts - 1
    kinds = max(1, -(-min(room, most - 1) // apart))

    def boxes(places: np.ndarray) -> np.ndarray:
        return rows.take(order.take(np.minimum(first + places[..., np.newaxis], last)), axis=0)

    # Boxes between two cuts, and beyond the last one; then the boxes before and behind each cut.
    left = boxes(np.arange(0, kinds * apart, skip).reshape(kinds, -1).T)
    left = left[0] if len(left) == 1 else left.min(axis=0)
    beyond = np.arange(kinds * apart, most, skip)
    right = np.empty_like(left)
    right[-1] = boxes(beyond).min(axis=0) if len(beyond) else left[-1]
    for k in range(kinds - 1, 0, -1):
        np.minimum(right[k], left[k], out=right[k - 1])
    for k in range(1, kinds):
        np.minimum(left[k - 1], left[k], out=left[k])
    before = apart * np.arange(1, kinds + 1)[:, np.newaxis]
    after = counts - before
    costs = _areas(left, step) * before.astype(np.float32) + _areas(right, step) * after.astype(np.float32)
    # Cost and cut in one number, so that a minimum finds both: floats above 0 are in the order of their bits.
    words = costs.view(np.uint32) & np.uint32(2**32 - MOST_CUTS) | np.arange(kinds, dtype=np.uint32)[:, np.newaxis]
    least = np.where((after > 0) & (after <= room), words, NEVER).min(axis=0)
    return least, np.where(least < NEVER, apart * ((least & np.uint32(MOST_CUTS - 1)).astype(np.int64) + 1), counts)


FEWEST = 64  # the least number of triangles for parts: a smaller tree is traversed quickly
# The least ratio of the boxes' area to that of the triangles' projections on their sides for which parts pay. Smooth
# meshes have 2.6 and become slower by parts, rods in all directions have 181.
SLANTING = 8.0
FALLS = 2 / 3  # the largest ratio of the boxes' areas, after and before the number of parts doubles, for which it pays
MOST = 16  # parts per triangle, on average
MOST_PARTS = 2**19  # in all, to limit the time of construction
ROUNDS = 2  # the number of parts doubles in each round, so that halves may be halved again
# The margin of a box around its part: a share of the size of all boxes together, and one of the largest coordinate.
BESIDE, ROUNDED = 16 * UNIT_ROUNDOFF["float32"], 2 * UNIT_ROUNDOFF["float32"]


def _half_areas(lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
    """Return half the surface of boxes (3, n) [m^2]."""
    x, y, z = (upper - lower).astype(np.float64)
    return x * y + y * z + z * x


def slant(corners: np.ndarray) -> float:
    """Return half the area of all triangles' boxes over that of their projections; triangles are (n, 9)."""
    sums: list[tuple[float, float]] = []

    def work(piece: slice) -> None:
        taken = corners[piece].T.astype(np.float64).reshape(3, 3, -1)
        boxes = _half_areas(taken.min(axis=0), taken.max(axis=0))
        sums.append((float(boxes.sum()), float(shadows(taken).sum())))

    in_pieces(len(corners), work)
    boxes, shade = (sum(areas) for areas in zip(*sums, strict=True))
    return boxes / shade if shade > 0 else 1.0


def _room(count: int) -> int:
    """Return the largest number of parts of `count` triangles: a power of two, like the leaves of a tree."""
    return 2 ** (min(MOST * count, MOST_PARTS).bit_length() - 1)


def slanting(corners: np.ndarray) -> bool:
    """Return whether triangles, rows of nine numbers, are to be cut into parts."""
    count = len(corners)
    return count >= FEWEST and _room(count) >= 2 * count and slant(corners) >= SLANTING


def _planes(lower: np.ndarray, upper: np.ndarray, base: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return each box's longest axis, and the plane across it of the common grid that is nearest to its middle."""
    axis = np.argmax(upper - lower, axis=0)
    at = axis, np.arange(len(axis))
    low, high, origin = lower[at], upper[at], base[axis]
    # The planes are a quarter to a half of the box's length apart, so that the nearest is in its middle half.
    apart = np.exp2(np.floor(np.log2(high - low)) - 1)
    return axis, origin + apart * np.round(((low + high) / 2 - origin) / apart)


def _halves(
    corners: np.ndarray, lower: np.ndarray, upper: np.ndarray, *, base: np.ndarray, margin: float
) -> np.ndarray:
    """Return the boxes of the two halves of each part, (half, lower or upper corner, 3, n) [m].

    A part is the intersection of a triangle, `corners` (3, 3, n), with its box (3, n); its halves are the intersections
    of the box with the triangle before and behind the plane.
    """
    axis, plane = _planes(lower, upper, base)
    along = np.take_along_axis(corners, axis[np.newaxis, np.newaxis], axis=1)[:, 0]

    def add(box: np.ndarray, point: np.ndarray, there: np.ndarray) -> None:
        # Points on the wrong side are moved to infinity, so that minima ignore them: three times as fast as masks.
        aside = np.where(there, 0.0, np.inf)
        np.minimum(box[0], point + aside, out=box[0])
        np.maximum(box[1], point - aside, out=box[1])

    empty = np.full((2, 3, len(axis)), np.array([np.inf, -np.inf])[:, np.newaxis, np.newaxis])
    for first, second in ((0, 1), (1, 2), (2, 0)):
        crosses = (along[first] < plane) != (along[second] < plane)
        share = (plane - along[first]) / np.where(crosses, along[second] - along[first], 1.0)
        add(empty, corners[first] + share * (corners[second] - corners[first]), crosses)
    boxes = np.stack([empty, empty])
    for corner, at in zip(corners, along, strict=True):
        add(boxes[0], corner, at <= plane)
        add(boxes[1], corner, at >= plane)
    boxes[:, 0] = np.maximum(boxes[:, 0] - margin, lower)
    boxes[:, 1] = np.minimum(boxes[:, 1] + margin, upper)
    return boxes


class _GrowingParts:
    """A growing list of parts: their boxes, and those of the halves of each."""

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
        """Compute the halves of these parts, and their gain."""

        def work(piece: slice) -> None:
            selected = parts[piece]
            corners = self._corners[self._owner[selected]].T.astype(np.float64).reshape(3, 3, -1)
            lower, upper = self._boxes.take(selected, axis=2).astype(np.float64)
            # Near the margin one side of a plane may contain no point of the triangle.
            large = (upper - lower).max(axis=0) > 16 * self._margin
            kept = slice(None) if large.all() else large
            selected, corners, lower, upper = selected[kept], corners[..., kept], lower[:, kept], upper[:, kept]
            halves = _halves(corners, lower, upper, base=self._base, margin=self._margin)
            self._gains[parts[piece]] = 0.0
            self._gains[selected] = _half_areas(lower, upper) - sum(_half_areas(*half) for half in halves)
            self._split[..., selected] = halves

        in_pieces(len(parts), work)

    def grow(self, count: int) -> None:
        """Halve the parts with the largest gain until there are `count`, at most twice the present number."""
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
    growing = _GrowingParts(corners, lower, upper)
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
