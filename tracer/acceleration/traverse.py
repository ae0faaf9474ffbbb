"""A bundle's way through a tree, without a stack: all rays of a lane go together.

The state is the node's heap index `key` and `trail`, one bit per level that says whether the sibling is still to be
visited: to go back, climb to the deepest set bit and turn to the sibling. Which boxes are entered is decided for the
bundle (`tracer.acceleration.beams`); in a leaf every ray meets every item by the formula that was chosen for it.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import drjit as dr

from tracer.acceleration.beams import Beam
from tracer.acceleration.build import LEAF_SIZE
from tracer.acceleration.nodes import Nodes
from tracer.arrays import ArrayTypes
from tracer.configuration import Configuration
from tracer.rays import Interval, Ray

NONE = 0x7FFFFFFF  # the number of no item
# A bound of float64 is compared in float32, rounded up by more than the conversion may round down.
WIDER = 1 + 2.0**-22


class Grove(Protocol):
    """Items of one kind in a tree."""

    nodes: Nodes
    types: ArrayTypes

    def item(self, slot: Any) -> tuple[Any, Any]:
        """Return the item in a slot of a leaf, and its number."""
        ...

    def meet(self, configuration: Configuration, ray: Ray, item: Any, interval: Interval) -> Any:
        """Return the t at which a ray meets an item, or inf."""
        ...

    def shape(self, number: Any, active: Any) -> Any:
        """Return the index of the shape that an item belongs to."""
        ...

    def face(self, number: Any, active: Any) -> Any:
        """Return an item's face index in its shape."""
        ...


@dataclass(frozen=True, kw_only=True)
class Walk:
    """What a bundle needs on its way through one tree: `meet(item, k)` is the t at which its ray k meets an item."""

    grove: Grove
    beam: Beam
    meet: Callable[[Any, int], Any]


def _pop(key: Any, trail: Any) -> tuple[Any, Any]:
    """Return the deepest sibling still to be visited, or key 0 where none is left."""
    levels = dr.tzcnt(trail)
    done = trail == 0
    levels = dr.select(done, 0, levels)
    return dr.select(done, 0, (key >> levels) ^ 1), dr.select(done, 0, (trail >> levels) ^ 1)


def _descend(walk: Walk, key: Any, trail: Any, limit: Any) -> tuple[Any, Any]:
    """Return the next leaf whose box is entered before `limit`, or key 0."""
    nodes = walk.grove.nodes
    UInt = walk.grove.types.UInt

    def inside(key: Any, trail: Any) -> Any:
        return (key != 0) & (key < nodes.leaves)

    def step(key: Any, trail: Any) -> tuple[Any, Any]:
        left_box, right_box = nodes.children(key, inside(key, trail))
        left, left_enter = walk.beam.meets(left_box, limit)
        right, right_enter = walk.beam.meets(right_box, limit)
        go_right = right & (~left | (right_enter < left_enter))
        popped_key, popped_trail = _pop(key, trail)
        some = left | right
        return (
            dr.select(some, (key << 1) | dr.select(go_right, UInt(1), 0), popped_key),
            dr.select(some, (trail << 1) | dr.select(left & right, UInt(1), 0), popped_trail),
        )

    return dr.while_loop(state=(key, trail), cond=inside, body=step, labels=("key", "trail"))


def _leaf(walk: Walk, key: Any) -> list[tuple[Any, Any]]:
    """Return (item, number) for each slot of the leaf that was reached.

    Lanes that are done look at the first leaf once more. They lose nothing by it, and nobody has to be told apart.
    """
    first = (dr.select(key == 0, walk.grove.nodes.leaves, key) - walk.grove.nodes.leaves) * LEAF_SIZE
    return [walk.grove.item(first + place) for place in range(LEAF_SIZE)]


def _begin(types: ArrayTypes, active: Any, width: int) -> tuple[Any, Any]:
    """Return the state before the first step; a loop's state must have full width from the start."""
    return dr.select(active, dr.full(types.UInt, 1, width), 0), dr.zeros(types.UInt, width)


def _largest(values: Sequence[Any]) -> Any:
    largest = values[0]
    for value in values[1:]:
        largest = dr.select(value > largest, value, largest)
    return largest


def nearest(
    walk: Walk, *, closer: Callable[[Any, Any], Any], limits: Sequence[Any], width: int
) -> list[tuple[Any, Any]]:
    """Return, per ray, distance (inf: none up to its limit) and number of the nearest item, at a tie the lower one."""
    types = walk.grove.types
    Single: Any = dr.float32_array_t(types.Float)
    key, trail = _begin(types, types.Bool(True), width)
    bests = [dr.full(types.Float, dr.inf, width) for _ in limits]
    numbers = [dr.full(types.Int, NONE, width) for _ in limits]

    def going(key: Any, trail: Any, bests: Any, numbers: Any) -> Any:
        return key != 0

    def step(key: Any, trail: Any, bests: Any, numbers: Any) -> tuple[Any, ...]:
        bests, numbers = list(bests), list(numbers)
        farthest = _largest([dr.select(best < limit, best, limit) for best, limit in zip(bests, limits, strict=True)])
        if types.precision == "float64":
            farthest = Single(farthest) * WIDER
        key, trail = _descend(walk, key, trail, farthest)
        for item, candidate in _leaf(walk, key):
            for k, (best, number) in enumerate(zip(bests, numbers, strict=True)):
                t = walk.meet(item, k)
                # Where both are inf the number means nothing.
                take = closer(t, best) | ((t == best) & (candidate < number))
                bests[k], numbers[k] = dr.select(take, t, best), dr.select(take, candidate, number)
        key, trail = _pop(key, trail)
        return key, trail, bests, numbers

    *_, bests, numbers = dr.while_loop(
        state=(key, trail, bests, numbers), cond=going, body=step, labels=("key", "trail", "bests", "numbers")
    )
    return list(zip(bests, numbers, strict=True))


def any_hit(
    walk: Walk, *, farthest: Any, skips: Callable[[Any, int], Any] | None, active: Sequence[Any], width: int
) -> list[Any]:
    """Return, per ray, the distance of some item that it meets, inf where there is none.

    `farthest` bounds the beam's t (float32); `skips(number, k)` says which items ray k leaves out.
    """
    types = walk.grove.types
    anyone = active[0]
    for one in active[1:]:
        anyone = anyone | one
    key, trail = _begin(types, anyone, width)
    found = [dr.full(types.Float, dr.inf, width) for _ in active]

    def going(key: Any, trail: Any, found: Any) -> Any:
        return key != 0

    def step(key: Any, trail: Any, found: Any) -> tuple[Any, Any, Any]:
        found = list(found)
        key, trail = _descend(walk, key, trail, farthest)
        for item, number in _leaf(walk, key):
            for k in range(len(found)):
                t = walk.meet(item, k)
                counts = t < dr.inf
                if skips is not None:
                    counts &= ~skips(number, k)
                found[k] = dr.select(counts, t, found[k])
        key, trail = _pop(key, trail)
        open_ = types.Bool(False)
        for k, one in enumerate(active):
            open_ = open_ | (one & (found[k] == dr.inf))
        return dr.select(open_, key, 0), trail, found

    *_, found = dr.while_loop(state=(key, trail, found), cond=going, body=step, labels=("key", "trail", "found"))
    return list(found)
