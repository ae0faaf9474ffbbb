"""A tree over boxes by the surface-area heuristic: a node is split where least is met on both sides.

The chance that a ray which meets a box also meets a box inside it is that of their areas. A split of n items into k and
n - k costs k times the area of the first ones' box and n - k times that of the others'; of all splits along the three
axes that leave neither side more items than leaves, the cheapest is taken. All nodes of a level are split together.
Source: MacDonald and Booth, "Heuristics for ray tracing using space subdivision", The Visual Computer 6 (1990); Wald,
"On fast Construction of SAH-based Bounding Volume Hierarchies", IEEE Symposium on Interactive Ray Tracing (2007).
"""

import numpy as np

from rayproof.tracer.acceleration.median_build import Tree


def _unit(lower: np.ndarray, upper: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the boxes' lower and upper corners (3, n) as shares of the longest side of all of them together."""
    least = lower.min(axis=1, keepdims=True).astype(np.float64)
    # Halved before they are subtracted: a difference may overflow.
    size = float((upper.max(axis=1) / 2 - least[:, 0] / 2).max()) or 1.0
    return (lower / 2 - least / 2) / size, (upper / 2 - least / 2) / size


def _largest_so_far(values: np.ndarray, node: np.ndarray) -> np.ndarray:
    """Return the largest of a node's values up to each, (..., n); values are in [0, 1], nodes in ascending order."""
    # One pass for all nodes: each begins above all values of the one before.
    return np.maximum.accumulate(values + 2.0 * node, axis=-1) - 2.0 * node


def _areas(lower: np.ndarray, upper: np.ndarray, node: np.ndarray) -> np.ndarray:
    """Return half the area of the box about each node's items up to each, (n,)."""
    x, y, z = _largest_so_far(upper, node) - (1 - _largest_so_far(1 - lower, node))
    return x * y + y * z + z * x


class _Level:
    """The nodes of a level: their items in contiguous places, sorted along each axis."""

    def __init__(self, order: np.ndarray, counts: np.ndarray) -> None:
        self.order, self.counts = order, counts  # (3, n) items, (nodes,)
        self.first = np.concatenate([[0], np.cumsum(counts)[:-1]])
        self.node = np.repeat(np.arange(len(counts)), counts)  # of each place
        self.place = np.arange(order.shape[1]) - self.first[self.node]  # of each place in its node

    def costs(self, lower: np.ndarray, upper: np.ndarray, room: int) -> np.ndarray:
        """Return what it costs to split a node after each place, (3, n); inf where a side would not have room."""
        left = self.place + 1
        right = self.counts[self.node] - left
        allowed = (left <= room) & (right <= room) & ((right > 0) | (left == 1))
        last = len(self.counts) - 1
        found = np.empty(self.order.shape)
        for axis, order in enumerate(self.order):
            low, high = lower[:, order], upper[:, order]
            before = _areas(low, high, self.node)
            after = _areas(low[:, ::-1], high[:, ::-1], last - self.node[::-1])[::-1]
            beyond = np.concatenate([after[1:], [0.0]])
            found[axis] = np.where(allowed, before * left + np.where(right > 0, beyond, 0.0) * right, np.inf)
        return found

    def split(self, costs: np.ndarray) -> "_Level":
        """Return the level below: each node split where it costs least, one of a single item into it and nothing."""
        full = np.flatnonzero(self.counts)
        starts = self.first[full]
        least = np.minimum.reduceat(costs, starts, axis=1)
        axis = np.argmin(least, axis=0)
        is_best = costs[np.repeat(axis, self.counts[full]), np.arange(costs.shape[1])] == np.repeat(
            least[axis, np.arange(len(full))], self.counts[full]
        )
        # The first place that costs so little.
        best = np.minimum.reduceat(np.where(is_best, self.place, costs.shape[1]), starts)
        counts = np.zeros((len(self.counts), 2), dtype=np.int64)
        counts[full, 0] = best + 1
        counts[:, 1] = self.counts - counts[:, 0]
        goes_left = np.empty(costs.shape[1], dtype=bool)  # by item
        chosen = self.order[np.repeat(axis, self.counts[full]), np.arange(costs.shape[1])]
        goes_left[chosen] = self.place < counts[self.node, 0]
        order = np.empty_like(self.order)
        for each, items in zip(order, self.order, strict=True):
            left = goes_left[items]
            passed = np.cumsum(left)
            # How many went left before, in this node; the others went right.
            before = passed - left - np.concatenate([[0], passed])[self.first[self.node]]
            to = np.where(left, before, counts[self.node, 0] + self.place - before)
            each[self.first[self.node] + to] = items
        return _Level(order, counts.reshape(-1))


def build_by_area(lower: np.ndarray, upper: np.ndarray) -> Tree:
    """Return a tree over boxes by their corners (3, n) [m], one item or none in a leaf.

    Raises:
        ValueError: there is no box.

    """
    count = lower.shape[1]
    if count == 0:
        raise ValueError("a tree needs at least one item")
    low, high = _unit(lower, upper)
    room = 1
    while room < count:
        room *= 2
    order = np.argsort(low + high, axis=1, kind="stable")
    level = _Level(order, np.array([count]))
    leaves = room
    while room > 1:
        room //= 2
        level = level.split(level.costs(low, high, room))
    # A leaf without items has a slot all the same: where nothing is culled, the first item is met there again.
    slots = np.zeros(leaves, dtype=np.int32)
    slots[level.node] = level.order[0]
    slots.setflags(write=False)
    return Tree(leaves=leaves, size=1, total=leaves, slots=slots, empty=level.counts == 0)
