"""A tree holds every item once, its nodes' boxes hold their items, and it is cut where that costs least."""

from typing import Any

import numpy as np
import pytest

from rayproof.tracer.kernel.arrays import array_types
from rayproof.tracer.kernel.parameters import LITERALS, DeviceBuffers
from rayproof.tracer.trees import build
from rayproof.tracer.trees.boxes import (
    LOWER,
    STEPS,
    UPPER,
    HostNodes,
    Nodes,
    on_grid,
    places,
    quantise,
    unpacked,
)
from rayproof.tracer.trees.build import CUTS, MOST_CUTS, Tree, tree_over

Corners = tuple[np.ndarray, np.ndarray]  # lower and upper ones of boxes, (3, n) [m]


def boxes(count: int, *, seed: int = 1, size: float = 1.0) -> Corners:
    random = np.random.default_rng(seed)
    lower = random.uniform(-size, size, (3, count)).astype(np.float32)
    return lower, lower + random.uniform(0, size / 5, (3, count)).astype(np.float32)


def area(rows: np.ndarray, step: np.ndarray) -> np.ndarray:
    """Return half the area of boxes on a grid; of those inside out 0."""
    words = rows.astype(np.float64)
    x, y, z = (np.maximum(STEPS - words[..., LOWER + k] - words[..., UPPER + k], 0) * step[k] for k in range(3))
    return x * y + y * z + z * x


def items_of(tree: Tree, leaves: range) -> np.ndarray:
    """Return the items in some leaves, in ascending order."""
    first = tree.first(np.arange(tree.leaves + 1))
    filled = [leaf for leaf in leaves if not tree.empty[leaf]]
    return np.sort(np.concatenate([tree.slots[first[leaf] : first[leaf + 1]] for leaf in filled]))


def corners_of(nodes: HostNodes) -> np.ndarray:
    """Return lower and upper corners [m] of all nodes that are read as children, (nodes, 2, 3)."""
    types = array_types("float32")
    on_device = Nodes(nodes, types, DeviceBuffers(), name="tree", parameters=LITERALS)
    coordinates, corner, scale = unpacked(on_device.read(types.UInt(np.arange(len(nodes.words), dtype=np.uint32))))
    steps = [[place * scale[k % 3] + corner[k % 3] for place in places(word)] for k, word in enumerate(coordinates)]
    return nodes.base + np.array(steps).transpose(2, 1, 0).reshape(-1, 2, 3) * nodes.step


@pytest.mark.usefixtures("each_builder")
@pytest.mark.parametrize("lost", [0, 40, 99])
def test_a_tree_that_lost_an_item_is_not_built(lost: int, monkeypatch: pytest.MonkeyPatch) -> None:
    put = build._Growing._put

    def forgetful(self: Any, *about: Any) -> None:
        put(self, *about)
        self.slots[self.slots == lost] = 7

    monkeypatch.setattr(build._Growing, "_put", forgetful)

    with pytest.raises(RuntimeError, match="of 100 items stand in no leaf"):
        tree_over(on_grid(*boxes(100)))


@pytest.mark.usefixtures("each_builder")
@pytest.mark.parametrize("count", [1, 2, 3, 4, 5, 7, 8, 9, 100, 1023, 1024, 1025])
def test_every_item_stands_in_one_leaf(count: int) -> None:
    tree = tree_over(on_grid(*boxes(count)))

    assert tree.leaves >= count > tree.leaves // 2
    assert tree.size == 1
    assert items_of(tree, range(tree.leaves)).tolist() == list(range(count))
    assert set(tree.slots) == set(range(count))


@pytest.mark.usefixtures("each_builder")
@pytest.mark.parametrize("most", [4, 16])
def test_where_there_are_no_more_leaves_they_hold_several_items(most: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(build, "MOST_LEAVES", most)

    tree = tree_over(on_grid(*boxes(61)))

    held = np.diff(tree.first(np.arange(tree.leaves + 1)))
    assert (tree.leaves, tree.total, tree.size) == (most, 61, -(-61 // most))
    assert set(held) <= {tree.size - 1, tree.size}
    assert items_of(tree, range(most)).tolist() == list(range(61))
    assert len(tree.slots) == tree.total + tree.size - 1


@pytest.mark.usefixtures("each_builder")
@pytest.mark.parametrize("count", [1, 2, 3, 5, 9, 100, 1025])
def test_boxes_hold_their_items_and_nothing_for_leaves_without(count: int) -> None:
    lower, upper = boxes(count)
    on = on_grid(lower, upper)
    tree = tree_over(on)
    nodes = quantise(tree, on)
    corners = corners_of(nodes)
    root = 2 if nodes.leaves.bit_length() % 2 == 0 else 1

    for leaf in range(tree.leaves):
        node = tree.leaves + leaf
        while node >= max(2, 2 * root - 2):
            low, high = corners[node]
            if tree.empty[leaf]:
                assert (low > high).all()
                break
            (item,) = items_of(tree, range(leaf, leaf + 1))
            assert (low <= lower[:, item]).all()
            assert (high >= upper[:, item]).all()
            node //= 4


@pytest.mark.parametrize("seed", range(5))
def test_the_root_is_cut_where_that_is_cheapest(seed: int) -> None:
    count = 2 * CUTS - 27
    on = on_grid(*boxes(count, seed=seed))
    tree = tree_over(on)
    half = tree.leaves // 2

    def cost(items: np.ndarray) -> float:
        others = np.setdiff1d(np.arange(count), items)
        return sum(len(side) * float(area(on.rows[side].min(axis=0), on.step)) for side in (items, others))

    known = []
    for axis in range(3):
        words = on.rows.astype(np.int64)
        order = np.argsort((words[:, LOWER + axis] + STEPS - words[:, UPPER + axis]) // 2, kind="stable")
        known += [cost(order[:k]) for k in range(max(1, count - half), min(half, count - 1) + 1)]
    # Costs are compared by the upper bits of a float32.
    assert cost(items_of(tree, range(half))) <= min(known) * (1 + MOST_CUTS * 2.0**-23)


def test_a_tree_in_halves_is_cut_in_the_middle_of_the_longest_axis(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(build, "MOST_BY_AREA", 0)
    lower, upper = boxes(64)
    lower[1] *= 10
    upper[1] *= 10
    tree = tree_over(on_grid(lower, upper))
    y = (lower + upper)[1, tree.slots]

    # Middles are compared on the grid.
    assert y[:32].max() <= y[32:].min() + 4 * (upper[1].max() - lower[1].min()) / STEPS


@pytest.mark.usefixtures("each_builder")
def test_boxes_that_lie_in_one_place_are_spread() -> None:
    tree = tree_over(on_grid(*(np.full((3, 300), value, dtype=np.float32) for value in (0.25, 0.5))))

    assert items_of(tree, range(tree.leaves)).tolist() == list(range(300))


@pytest.mark.usefixtures("each_builder")
@pytest.mark.parametrize("size", [1e-30, 1e30, 3e38])
def test_sizes_at_the_ends_of_the_floats_are_no_matter(size: float) -> None:
    with np.errstate(all="raise"):
        tree = tree_over(on_grid(*(np.float32(size) * (end / np.float32(2)) for end in boxes(200))))

    assert items_of(tree, range(tree.leaves)).tolist() == list(range(200))


def test_without_a_box_there_is_no_tree() -> None:
    with pytest.raises(ValueError, match="at least one item"):
        on_grid(np.zeros((3, 0), np.float32), np.zeros((3, 0), np.float32))
