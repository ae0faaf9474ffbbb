"""A balanced binary tree of boxes in heap order, built by numpy.

Node i has the children 2 i and 2 i + 1; nodes `leaves` .. 2 leaves - 1 are leaves of LEAF_SIZE items each. To fill
them all, some items stand in two slots, which changes no answer.
"""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

LEAF_SIZE = 2
THREADS = 2  # numpy lets go of the interpreter in all that takes long


@dataclass(frozen=True, kw_only=True)
class Tree:
    """A tree over boxes; read-only arrays."""

    leaves: int  # a power of two
    slots: np.ndarray  # (leaves * LEAF_SIZE,) index of the item in each slot
    boxes: np.ndarray  # (2 leaves, 6): lower corner, upper corner [m]; row 0 is unused


def _spread(count: int) -> tuple[int, np.ndarray]:
    """Return the number of leaves, and the items that fill them, duplicates spread evenly."""
    leaves = 1
    while leaves * LEAF_SIZE < count:
        leaves *= 2
    # No subtree holds copies only.
    return leaves, (np.arange(leaves * LEAF_SIZE) * count // (leaves * LEAF_SIZE)).astype(np.int32)


def _halved(orders: list[np.ndarray], keys: list[np.ndarray]) -> list[np.ndarray]:
    """Return the orders (nodes, size) with every node split at the median along its longest axis: (2 nodes, size / 2).

    The items of a node stand in each order by their centres along one axis, and stay so.
    """
    nodes, size = orders[0].shape
    half = size // 2
    extents = [key[order[:, -1]] - key[order[:, 0]] for key, order in zip(keys, orders, strict=True)]
    longest = np.argmax(extents, axis=0)
    left = np.zeros(len(keys[0]), dtype=bool)
    for axis, order in enumerate(orders):
        left[order[longest == axis, :half].reshape(-1)] = True
    split = []
    for order in orders:
        flat = order.reshape(-1)
        chosen = left[flat]
        pairs = np.empty((nodes, 2, half), dtype=order.dtype)
        pairs[:, 0] = flat[chosen].reshape(nodes, half)
        pairs[:, 1] = flat[~chosen].reshape(nodes, half)
        split.append(pairs.reshape(2 * nodes, half))
    return split


def _leaves(orders: list[np.ndarray], keys: list[np.ndarray]) -> np.ndarray:
    """Return the items of one node, leaf by leaf."""
    while orders[0].shape[1] > LEAF_SIZE:
        orders = _halved(orders, keys)
    return orders[0].reshape(-1)


def build(lower: np.ndarray, upper: np.ndarray) -> Tree:
    """Return a tree over boxes by their corners (n, 3) [m], split at the median along each node's longest axis.

    Raises:
        ValueError: there is no box.

    """
    count = len(lower)
    if count == 0:
        raise ValueError("a tree needs at least one item")
    leaves, slots = _spread(count)
    # Halved before they are added: a sum may overflow.
    keys = [np.ascontiguousarray((lower[:, axis] / 2 + upper[:, axis] / 2)[slots]) for axis in range(3)]
    with ThreadPoolExecutor(THREADS) as pool:
        orders = list(pool.map(lambda key: np.argsort(key, kind="stable").astype(np.int32)[np.newaxis], keys))
        if len(slots) > LEAF_SIZE:
            # What is left of the first cut and what is right of it are trees of their own.
            left, right = zip(*(order for order in _halved(orders, keys)), strict=True)
            halves = [[order[np.newaxis] for order in side] for side in (left, right)]
            order = np.concatenate(list(pool.map(lambda half: _leaves(half, keys), halves)))
        else:
            order = orders[0].reshape(-1)
    slots = slots[order]
    boxes = np.zeros((2 * leaves, 6), dtype=lower.dtype)
    boxes[leaves:, :3] = lower[slots].reshape(leaves, LEAF_SIZE, 3).min(axis=1)
    boxes[leaves:, 3:] = upper[slots].reshape(leaves, LEAF_SIZE, 3).max(axis=1)
    first = leaves
    while first > 1:
        pairs = boxes[first : 2 * first].reshape(-1, 2, 6)
        first //= 2
        boxes[first : 2 * first, :3] = np.minimum(pairs[:, 0, :3], pairs[:, 1, :3])
        boxes[first : 2 * first, 3:] = np.maximum(pairs[:, 0, 3:], pairs[:, 1, 3:])
    for array in (slots, boxes):
        array.setflags(write=False)
    return Tree(leaves=leaves, slots=slots, boxes=boxes)
