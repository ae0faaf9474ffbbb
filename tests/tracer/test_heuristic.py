"""The tree by areas holds every item once, splits where it is cheapest, and has less to meet than that of medians."""

import numpy as np
import pytest

from rayproof.cases.benchmark.meshes import bumpy, uneven
from rayproof.tracer.acceleration.grid_boxes import on_grid
from rayproof.tracer.acceleration.median_build import Tree, build
from rayproof.tracer.acceleration.quantised_boxes import quantise
from rayproof.tracer.acceleration.sah_build import build_by_area
from rayproof.tracer.acceleration.triangle_bvh import bounds
from rayproof.tracer.shapes.triangles import baked


def boxes(count: int, *, seed: int = 1, size: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(seed)
    lower = random.uniform(-size, size, (3, count)).astype(np.float32)
    return lower, lower + random.uniform(0, size / 5, (3, count)).astype(np.float32)


def area(lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
    x, y, z = np.asarray(upper, np.float64) - lower
    return x * y + y * z + z * x


def inner_area(tree: Tree, lower: np.ndarray, upper: np.ndarray) -> float:
    """Return half the area of all boxes above the leaves."""
    slots = tree.slots[tree.first(np.arange(tree.leaves))]
    low = np.where(tree.empty, np.inf, lower[:, slots].astype(np.float64))
    high = np.where(tree.empty, -np.inf, upper[:, slots].astype(np.float64))
    total = 0.0
    while low.shape[1] > 1:
        low, high = np.minimum(low[:, ::2], low[:, 1::2]), np.maximum(high[:, ::2], high[:, 1::2])
        some = np.isfinite(low[0])
        total += float(area(low[:, some], high[:, some]).sum())
    return total


@pytest.mark.parametrize("count", [1, 2, 3, 4, 5, 7, 8, 9, 100, 1023, 1024, 1025])
def test_every_item_stands_in_one_leaf(count: int) -> None:
    tree = build_by_area(*boxes(count))

    assert tree.leaves >= count > tree.leaves // 2
    assert sorted(tree.slots[~tree.empty]) == list(range(count))
    assert set(tree.slots[tree.empty]) <= set(range(count))


@pytest.mark.parametrize("count", [1, 2, 3, 5, 9, 100])
def test_boxes_hold_their_items_and_nothing_for_leaves_without(count: int) -> None:
    lower, upper = boxes(count)
    tree = build_by_area(lower, upper)
    nodes = quantise(tree, on_grid(lower, upper))
    root = 2 if nodes.leaves.bit_length() % 2 == 0 else 1

    for leaf, (slot, empty) in enumerate(zip(tree.slots, tree.empty, strict=True)):
        node = tree.leaves + leaf
        while node >= max(2, 2 * root - 2):
            word = nodes.words[node // 4, node % 4]
            low, high = nodes.base + (word & 0xFFFF) * nodes.step, nodes.base + (word >> 16) * nodes.step
            if empty:
                assert (low > high).all()
                break
            assert (low <= lower[:, slot]).all()
            assert (high >= upper[:, slot]).all()
            node //= 4


@pytest.mark.parametrize("seed", range(5))
def test_the_root_is_split_where_that_is_cheapest(seed: int) -> None:
    count = 37
    lower, upper = boxes(count, seed=seed)
    tree = build_by_area(lower, upper)
    half = tree.leaves // 2

    def cost(items: np.ndarray) -> float:
        others = np.setdiff1d(np.arange(count), items)
        return sum(
            len(side) * float(area(lower[:, side].min(axis=1), upper[:, side].max(axis=1))) for side in (items, others)
        )

    known = []
    for axis in range(3):
        order = np.argsort(lower[axis] + upper[axis], kind="stable")
        known += [cost(order[:k]) for k in range(max(1, count - half), min(half, count - 1) + 1)]
    chosen = np.sort(tree.slots[:half][~tree.empty[:half]])
    assert cost(chosen) == pytest.approx(min(known), rel=1e-6)


def test_boxes_that_lie_in_one_place_are_spread() -> None:
    lower, upper = (np.full((3, 300), value, dtype=np.float32) for value in (0.25, 0.5))

    tree = build_by_area(lower, upper)

    assert sorted(tree.slots[~tree.empty]) == list(range(300))


@pytest.mark.parametrize("size", [1e-30, 1e30, 3e38])
def test_sizes_at_the_ends_of_the_floats_are_no_matter(size: float) -> None:
    lower, upper = boxes(200)
    usual = build_by_area(lower, upper)
    with np.errstate(all="raise"):
        scaled = build_by_area(*(np.float32(size) * (end / np.float32(2)) for end in (lower, upper)))

    assert np.array_equal(np.sort(scaled.slots), np.sort(usual.slots))


def test_without_a_box_there_is_no_tree() -> None:
    with pytest.raises(ValueError, match="at least one item"):
        build_by_area(np.zeros((3, 0), np.float32), np.zeros((3, 0), np.float32))


@pytest.mark.parametrize(("mesh", "share"), [(bumpy(4), 0.9), (uneven(4000), 1.0)])
def test_there_is_less_to_meet_than_in_a_tree_of_medians(mesh: object, share: float) -> None:
    ends = bounds(baked(mesh))  # type: ignore[arg-type]

    assert inner_area(build_by_area(*ends), *ends) < share * inner_area(build(*ends), *ends)
