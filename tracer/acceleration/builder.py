"""A tree over boxes on a grid, each of whose nodes is cut where least is met on both sides (`area_cuts`).

Of the cuts across the axes along which a node is long, the cheapest is taken that leaves neither side more items than
leaves. A very large tree gains nothing by that: each of its nodes is halved across its longest axis, and its items lie
without a gap. All leaves are on one level, as in a binary heap. A tree is cut into pieces, which several threads build:
level by level, all nodes of one at once, whose items are sorted along each axis when the piece is begun.
"""

import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property
from itertools import repeat

import numpy as np

from rayproof.tracer.acceleration.area_cuts import NEVER, cheapest
from rayproof.tracer.acceleration.grid_boxes import AXES, LOWER, ROW, STEPS, UPPER, GridBoxes

MOST_LEAVES = 2**21  # what the trail of a traversal has bits for; a larger tree has larger leaves
MOST_BY_AREA = 2**19  # items; 1.3 million as small as pixels were as fast by halves, and there sooner
PIECE = 2**15  # leaves; with fewer, numpy is called more often, and what more have leaves the cache
CUTS, CUTS_IN_PIECES = 32, 16  # that are compared along an axis; a tree of one piece is there at once anyway
LONG = 0.4  # of a node's longest axis, what another one must reach to be cut across; no area is lost by it
FEW = 2  # items that have a leaf each without a cut
THREADS = min(8, os.cpu_count() or 1)  # numpy lets go of the interpreter in all that takes long


@dataclass(frozen=True, kw_only=True)
class Tree:
    """The order of the items in the leaves. Leaf i holds the slots from i total / leaves up to that of i + 1."""

    leaves: int  # a power of two
    size: int  # slots of the largest leaf
    total: int  # slots
    slots: np.ndarray  # (total + size - 1,) int32, index of the item in each slot; the last one repeats
    empty: np.ndarray  # (leaves,) bool, leaves without items

    def first(self, leaf: np.ndarray) -> np.ndarray:
        """Return the first slot of a leaf, counted from 0; of `leaves` the end."""
        return leaf.astype(np.int64) * self.total // self.leaves


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
        """Return each node's first place."""
        return np.cumsum(self.counts) - self.counts

    def extents(self, step: np.ndarray) -> np.ndarray:
        """Return how far apart the middles of a node's items lie along each axis, (AXES, nodes)."""
        ends = ROW * self.order[:, np.stack([self.first, self.first + self.counts - 1])]
        words, axes = self.rows.reshape(-1), np.arange(AXES)[:, np.newaxis, np.newaxis]
        middles = words.take(ends + LOWER + axes).astype(np.float32) - words.take(ends + UPPER + axes)
        return (middles[:, 1] - middles[:, 0]) * step[:, np.newaxis]

    def cut(self, axis: np.ndarray, before: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return all children's numbers and counts, and their items, child by child; `before` go to the first."""
        places = self.order.shape[1]
        items = self.order.reshape(-1).take(np.arange(places) + np.repeat(places * axis, self.counts))
        counts = np.stack([before, self.counts - before], axis=1).reshape(-1)
        return (2 * self.number[:, np.newaxis] + np.arange(2)).reshape(-1), counts, items

    def children(self, number: np.ndarray, counts: np.ndarray, items: np.ndarray, kept: np.ndarray) -> "_Nodes":
        """Return those of the children that are `kept`."""
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
        """Return the axis that each node, of so many leaves, is cut across, and how many items its first child has."""
        extents = nodes.extents(self._step)
        longest = extents.argmax(axis=0)
        if not self._by_area:
            return longest, self._first(leaves * nodes.number + leaves // 2) - self._first(leaves * nodes.number)
        axis, node = np.nonzero(extents >= LONG * extents[longest, np.arange(len(longest))])
        place = nodes.first[node] + axis * nodes.order.shape[1]
        found = cheapest(
            nodes.rows,
            nodes.order.reshape(-1),
            place,
            nodes.counts[node],
            room=leaves // 2,
            cuts=CUTS if self.leaves <= PIECE else CUTS_IN_PIECES,
            step=self._step,
        )
        costs, before = np.full(extents.shape, NEVER), np.empty(extents.shape, dtype=np.int64)
        costs[axis, node], before[axis, node] = found
        best = np.where(costs.min(axis=0) < NEVER, costs.argmin(axis=0), longest)
        return best, before[best, np.arange(len(best))]

    def _first(self, leaf: np.ndarray) -> np.ndarray:
        return leaf * self.total // self.leaves

    def _put(self, items: np.ndarray, number: np.ndarray, counts: np.ndarray, first: np.ndarray, leaves: int) -> None:
        """Put what nodes have, from `items[first]` on, into slots; where they have leaves, each into one's first."""
        for place in range(int(counts.max(initial=0))):
            some = counts > place
            leaf = number[some] * leaves + place * (leaves // 2)
            self.slots[self._first(leaf) + (place if leaves == 1 else 0)] = items[first[some] + place]
            self.empty[leaf] = False

    def halves(self, part: _Part, leaves: int) -> list[_Part]:
        """Cut a node of so many leaves, more than a piece has; as many items as a piece has stand for all."""
        count, room, every = len(part.items), leaves // 2, leaves // PIECE
        nodes = _Nodes.alone(part.number, np.ascontiguousarray(part.rows[::every]))
        (axis,), (before,) = self._cuts(nodes, PIECE if self._by_area else leaves)
        if self._by_area:
            before = min(max(every * before, count - room), room, count)
        # Items in one place stay in their order.
        words = _middles(part.rows, axis).astype(np.uint64) << 32 | np.arange(count, dtype=np.uint64)
        goes_first = words <= np.partition(words, before - 1)[before - 1]
        sides = np.flatnonzero(goes_first), np.flatnonzero(~goes_first)
        return [
            _Part(number=2 * part.number + k, items=part.items.take(side), rows=part.rows.take(side, axis=0))
            for k, side in enumerate(sides)
            if len(side)
        ]

    def fill(self, part: _Part, leaves: int) -> None:
        """Put the items of a node of so many leaves into slots."""
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
        RuntimeError: an item stands in no leaf, which is a mistake of this file.

    """
    growing = _Growing(boxes)
    # Items in one place along an axis stay in this order: of a grid, those of a column are cut where it is.
    items = np.lexsort([_middles(boxes.rows, axis) for axis in (2, 1, 0)]).astype(np.int32)
    parts = [_Part(number=0, items=items, rows=boxes.rows.take(items, axis=0))]
    leaves = growing.leaves
    with ThreadPoolExecutor(THREADS) as pool:
        while leaves > PIECE:
            parts = [half for two in pool.map(growing.halves, parts, repeat(leaves)) for half in two]
            leaves //= 2
        list(pool.map(growing.fill, parts, repeat(leaves)))
    # No image shows for certain that one item in thirty thousand is lost: most of them are seen by no pixel.
    held = np.zeros(len(items), dtype=bool)
    held[growing.slots[~growing.empty] if len(growing.slots) == growing.leaves else growing.slots] = True
    if not held.all():
        raise RuntimeError(f"the tree is broken: {np.count_nonzero(~held)} of {len(held)} items stand in no leaf")
    growing.slots.setflags(write=False)
    return Tree(leaves=growing.leaves, size=growing.size, total=growing.total, slots=growing.slots, empty=growing.empty)
