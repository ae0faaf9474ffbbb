"""A balanced tree over boxes, built by numpy: which item stands where.

Every node is split at the median of its items' centres along its longest axis, which np.partition finds without
sorting; all nodes of a level that fit into the processor's cache are split together. Leaves are numbered as in a
binary heap, `leaves` .. 2 leaves - 1, and hold one item or none. Above the last three levels all nodes of a level have
the same size, to which some items stand in two slots; that changes no answer.
"""

import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

LEAF_SIZE = 1  # measured against 2; an empty leaf costs its box, another item all rays
MOST_LEAVES = 2**21  # what the trail of a traversal has bits for; a larger tree has larger leaves
GROUP = 8  # leaves that are filled together
BLOCK = 2**14  # items that are split together: what stays in the cache
THREADS = min(8, os.cpu_count() or 1)  # numpy lets go of the interpreter in all that takes long
LARGEST = float(np.finfo(np.float32).max)
SHORT = 64  # items; a row below this is faster reduced across rows


@dataclass(frozen=True, kw_only=True)
class Tree:
    """The order of the items in the leaves. Leaf i holds the slots from i total / leaves up to that of i + 1."""

    leaves: int  # a power of two
    size: int  # slots of the largest leaf
    total: int  # slots
    slots: np.ndarray  # (total + size - 1,) index of the item in each slot; the last one repeats
    empty: np.ndarray  # (leaves,) bool, leaves without items

    def first(self, leaf: np.ndarray) -> np.ndarray:
        """Return the first slot of a leaf, counted from 0; of `leaves` the end."""
        return leaf.astype(np.int64) * self.total // self.leaves


def _shape(count: int) -> tuple[int, int, int]:
    """Return the number of leaves, of groups of leaves, and of slots in a group."""
    leaves = 1
    while leaves * LEAF_SIZE < count and leaves < MOST_LEAVES:
        leaves *= 2
    groups = max(1, leaves // GROUP)
    return leaves, groups, -(-count // groups)


def _centers(lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
    """Return what lies between, float32; any will do where that overflows."""
    # Halved before they are added: a sum may overflow.
    return np.clip(lower / 2 + upper / 2, -LARGEST, LARGEST).astype(np.float32)


def _ordered(values: np.ndarray) -> np.ndarray:
    """Return float32 numbers as uint32 numbers in the same order."""
    bits = values.view(np.int32)
    return ((bits >> 31) | np.int32(-(2**31))).view(np.uint32) ^ bits.view(np.uint32)


def _number(ordered: np.ndarray) -> np.ndarray:
    """Return the float32 numbers that `_ordered` was given, as float64."""
    bits = ordered.view(np.int32)
    mask = ((~bits >> 31) | np.int32(-(2**31))).view(np.uint32)
    return (mask ^ ordered).view(np.float32).astype(np.float64)


def _extents(keys: np.ndarray) -> np.ndarray:
    """Return the extent of each row."""
    if keys.shape[1] < SHORT:
        keys = np.ascontiguousarray(keys.T)
        return _number(keys.max(axis=0)) - _number(keys.min(axis=0))
    return _number(keys.max(axis=1)) - _number(keys.min(axis=1))


def _split(items: np.ndarray, keys: np.ndarray, at: int) -> None:
    """Put into each row's first `at` places the items that come first along the row's longest axis."""
    taken = [np.take(key, items) for key in keys]
    longest = np.argmax([_extents(key) for key in taken], axis=0)
    # Key and item in one number: what is partitioned moves as a whole.
    words = np.empty(items.shape, dtype="<u8")
    low, high = words.view("<u4")[:, ::2], words.view("<u4")[:, 1::2]
    low[...] = items
    if len(items) == 1:
        high[...] = taken[longest[0]]
    else:
        chosen = taken[0]
        for axis in (1, 2):
            np.copyto(chosen, taken[axis], where=(longest == axis)[:, np.newaxis])
        high[...] = chosen
    words.partition(at, axis=1)
    items[...] = low


def _grow(items: np.ndarray, keys: np.ndarray, groups: int, leaves: int) -> None:
    """Put the items of one node, which has `groups` groups and `leaves` leaves, into the order of the leaves."""
    half = len(items) // 2
    if len(items) > BLOCK and groups > 1:
        _split(items[np.newaxis], keys, half)
        for side in (items[:half], items[half:]):
            _grow(side, keys, groups // 2, leaves // 2)
        return
    rows = items[np.newaxis]
    while len(rows) < groups:
        _split(rows, keys, rows.shape[1] // 2)
        rows = rows.reshape(2 * len(rows), -1)
    each = leaves // groups
    _fill(rows, keys, [leaf * rows.shape[1] // each for leaf in range(each + 1)])


def _fill(rows: np.ndarray, keys: np.ndarray, first: list[int]) -> None:
    """Put each row's items into the order of its leaves, which begin at the places `first`; its last is the end."""
    middle = len(first) // 2
    if len(first) == 2 or rows.shape[1] < 2:
        return
    at = first[middle]
    if 0 < at < rows.shape[1]:
        part = rows.copy()
        _split(part, keys, at)
        rows[...] = part
    _fill(rows[:, :at], keys, first[: middle + 1])
    _fill(rows[:, at:], keys, [place - at for place in first[middle:]])


def build(lower: np.ndarray, upper: np.ndarray) -> Tree:
    """Return a tree over boxes by their corners (3, n) [m].

    Raises:
        ValueError: there is no box.

    """
    count = lower.shape[1]
    if count == 0:
        raise ValueError("a tree needs at least one item")
    leaves, groups, size = _shape(count)
    total = groups * size
    keys = np.stack([_ordered(_centers(*ends)) for ends in zip(lower, upper, strict=True)])
    # Copies are spread evenly: no subtree holds copies only.
    items = (np.arange(total, dtype=np.int64) * count // total).astype(np.int32)
    parts = [items]
    with ThreadPoolExecutor(THREADS) as pool:
        while len(parts) < min(THREADS, groups) and len(parts[0]) > BLOCK:
            half = len(parts[0]) // 2
            list(pool.map(lambda part: _split(part[np.newaxis], keys, len(part) // 2), parts))
            parts = [side for part in parts for side in (part[:half], part[half:])]
        list(pool.map(lambda part: _grow(part, keys, groups // len(parts), leaves // len(parts)), parts))
    largest = -(-size // (leaves // groups))
    slots = np.concatenate([items, np.repeat(items[-1:], largest - 1)])
    slots.setflags(write=False)
    first = np.arange(leaves + 1, dtype=np.int64) * total // leaves
    return Tree(leaves=leaves, size=largest, total=total, slots=slots, empty=first[:-1] == first[1:])
