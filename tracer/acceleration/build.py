"""A balanced binary tree of boxes in heap order, built by numpy.

Node i has the children 2 i and 2 i + 1; nodes `leaves` .. 2 leaves - 1 are leaves of LEAF_SIZE triangles each. To fill
them all, some triangles stand in two slots, which changes no answer.
"""

from dataclasses import dataclass

import numpy as np

LEAF_SIZE = 2


@dataclass(frozen=True, kw_only=True)
class Tree:
    """A tree over triangles; read-only arrays."""

    leaves: int  # a power of two
    slots: np.ndarray  # (leaves * LEAF_SIZE,) index of the triangle in each slot
    boxes: np.ndarray  # (2 leaves, 6) float32: lower corner, upper corner [m]; row 0 is unused


def build(corners: np.ndarray) -> Tree:
    """Return a tree over triangles (n, 3, 3) float32 [m], split at the median along each node's longest axis.

    Raises:
        ValueError: there is no triangle.

    """
    count = len(corners)
    if count == 0:
        raise ValueError("a tree needs at least one triangle")
    leaves = 1
    while leaves * LEAF_SIZE < count:
        leaves *= 2
    # Spread the duplicates evenly, so that no subtree holds copies only.
    nodes = (np.arange(leaves * LEAF_SIZE) * count // (leaves * LEAF_SIZE))[np.newaxis]
    lower, upper = corners.min(axis=1), corners.max(axis=1)
    centers = (lower.astype(np.float64) + upper) / 2
    while nodes.shape[1] > LEAF_SIZE:
        here = centers[nodes]
        axis = np.argmax(here.max(axis=1) - here.min(axis=1), axis=1)
        keys = np.take_along_axis(here, axis[:, np.newaxis, np.newaxis], axis=2)[..., 0]
        half = nodes.shape[1] // 2
        order = np.argpartition(keys, half, axis=1)
        nodes = np.take_along_axis(nodes, order, axis=1).reshape(-1, half)
    slots = nodes.reshape(-1)
    boxes = np.zeros((2 * leaves, 6), dtype=np.float32)
    boxes[leaves:, :3] = lower[slots].reshape(leaves, LEAF_SIZE, 3).min(axis=1)
    boxes[leaves:, 3:] = upper[slots].reshape(leaves, LEAF_SIZE, 3).max(axis=1)
    first = leaves
    while first > 1:
        pairs = boxes[first : 2 * first].reshape(-1, 2, 6)
        first //= 2
        boxes[first : 2 * first, :3] = pairs[:, :, :3].min(axis=1)
        boxes[first : 2 * first, 3:] = pairs[:, :, 3:].max(axis=1)
    for array in (slots, boxes):
        array.setflags(write=False)
    return Tree(leaves=leaves, slots=slots, boxes=boxes)
