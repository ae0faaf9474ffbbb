"""A bundle's way through a tree, without a stack: all rays of a lane go together.

The state is the node's heap index `key` and `trail`, three bits per level that say which siblings are still to be
visited: to go back, climb to the deepest set bit and turn to that sibling. Which boxes are entered is decided for the
bundle (`tracer.acceleration.beams`); in a leaf every ray meets every item by the formula that was chosen for it.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import drjit as dr

from rayproof.tracer.acceleration.packet_bounds import Beam
from rayproof.tracer.acceleration.quantised_boxes import Nodes
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.device.arrays import ArrayTypes
from rayproof.tracer.rays import Interval, Ray

NONE = 0x7FFFFFFF  # the number of no item
DONE = 0xFFFFFFFF  # the node of those that are done
# What is pending on a level are the siblings x = 1 .. 3 of the current child, counted by exclusive or: bit x - 1. Of
# the eight combinations, the one to turn to, and what is then pending as seen from there.
FIRST = (0, 1, 2, 1, 3, 1, 2, 1)
REST = (0, 0, 0, 4, 0, 2, 1, 6)
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


def _below(types: ArrayTypes, table: Sequence[int], place: Any) -> Any:
    """Return an entry below 16 of a table of eight: one word that is shifted."""
    word = sum(entry << (4 * k) for k, entry in enumerate(table))
    return (types.UInt(word) >> (place << 2)) & 15


def _pop(types: ArrayTypes, key: Any, trail: Any) -> tuple[Any, Any]:
    """Return the deepest node still to be visited, or key DONE where none is left."""
    Single: Any = dr.float32_array_t(types.Float)
    # The exponent of the lowest bit as a float: AVX2 has no instruction that counts zeros.
    lowest = Single(dr.int32_array_t(types.UInt)(trail & (~trail + 1)))
    bits: Any = dr.reinterpret_array(types.UInt, lowest)
    zeros = (bits >> 23) - 127
    done = trail == 0
    levels = dr.select(done, 0, (zeros * 11) >> 5)  # a third, for all below 32
    trail = trail >> (levels * 3)
    pending = trail & 7
    key = (key >> (levels * 2)) ^ _below(types, FIRST, pending)
    return dr.select(done, DONE, key), (trail & ~types.UInt(7)) | _below(types, REST, pending)


def _hits(types: ArrayTypes, hits: Sequence[Any], enters: Sequence[Any]) -> tuple[Any, Any, Any]:
    """Return whether any of four children is met, the nearest of them, and the others relative to it."""
    UInt = types.UInt
    t = [dr.select(hit, enter, dr.inf) for hit, enter in zip(hits, enters, strict=True)]
    second, fourth = t[1] < t[0], t[3] < t[2]
    upper = dr.select(fourth, t[3], t[2]) < dr.select(second, t[1], t[0])
    odd = (upper & fourth) | (~upper & second)
    child = dr.select(upper, UInt(2), 0) | dr.select(odd, UInt(1), 0)
    bits = [dr.select(hit, UInt(1 << k), 0) for k, hit in enumerate(hits)]
    some = (bits[0] | bits[1]) | (bits[2] | bits[3])
    others = dr.select(odd, ((some & 5) << 1) | ((some >> 1) & 5), some)
    others = dr.select(upper, ((others & 3) << 2) | (others >> 2), others)
    return some != 0, child, others >> 1


def _descend(walk: Walk, key: Any, trail: Any, limit: Any) -> tuple[Any, Any]:
    """Return the next leaf whose box is entered before `limit`, or key DONE."""
    nodes, types = walk.grove.nodes, walk.grove.types

    def inside(key: Any, trail: Any) -> Any:
        return key < nodes.leaves

    def step(key: Any, trail: Any) -> tuple[Any, Any]:
        hits, enters = zip(*(walk.beam.meets(box, limit) for box in nodes.children(key)), strict=True)
        some, child, others = _hits(types, hits, enters)
        popped_key, popped_trail = _pop(types, key, trail)
        return (
            dr.select(some, (key << 2) | child, popped_key),
            dr.select(some, (trail << 3) | others, popped_trail),
        )

    return dr.while_loop(state=(key, trail), cond=inside, body=step, labels=("key", "trail"))


def _leaf(walk: Walk, key: Any) -> list[tuple[Any, Any]]:
    """Return (item, number) for each slot of the leaf that was reached.

    Lanes that are done look at the first leaf once more. They lose nothing by it, and nobody has to be told apart.
    """
    nodes = walk.grove.nodes
    leaf = dr.select(key == DONE, 0, key - nodes.leaves)
    return [walk.grove.item(slot) for slot in nodes.slots(leaf)]


def _begin(walk: Walk, active: Any, width: int) -> tuple[Any, Any]:
    """Return the state before the first step; a loop's state must have full width from the start."""
    types, nodes = walk.grove.types, walk.grove.nodes
    UInt = types.UInt
    root, trail = dr.full(UInt, 1, width), dr.zeros(UInt, width)
    if nodes.halves:
        # Both halves are visited, the nearer one first.
        _, _, left, right = nodes.children(UInt(0))
        Single: Any = dr.float32_array_t(types.Float)
        limit = Single(dr.inf)
        (_, enter), (_, other) = walk.beam.meets(left, limit), walk.beam.meets(right, limit)
        root, trail = (root * 2) | dr.select(other < enter, UInt(1), 0), trail + 1
    return dr.select(active, root, DONE), trail


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

    def on(key: Any, trail: Any, bests: Sequence[Any]) -> tuple[Any, Any]:
        farthest = _largest([dr.select(best < limit, best, limit) for best, limit in zip(bests, limits, strict=True)])
        if types.precision == "float64":
            farthest = Single(farthest) * WIDER
        return _descend(walk, key, trail, farthest)

    bests = [dr.full(types.Float, dr.inf, width) for _ in limits]
    numbers = [dr.full(types.Int, NONE, width) for _ in limits]
    # A leaf is reached before the loop and at the end of each round: where there is none, none is looked at.
    key, trail = on(*_begin(walk, types.Bool(True), width), bests)

    def going(key: Any, trail: Any, bests: Any, numbers: Any) -> Any:
        return key != DONE

    def step(key: Any, trail: Any, bests: Any, numbers: Any) -> tuple[Any, ...]:
        bests, numbers = list(bests), list(numbers)
        for item, candidate in _leaf(walk, key):
            for k, (best, number) in enumerate(zip(bests, numbers, strict=True)):
                t = walk.meet(item, k)
                # Where both are inf the number means nothing.
                take = closer(t, best) | ((t == best) & (candidate < number))
                bests[k], numbers[k] = dr.select(take, t, best), dr.select(take, candidate, number)
        key, trail = on(*_pop(types, key, trail), bests)
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
    key, trail = _descend(walk, *_begin(walk, anyone, width), farthest)
    found = [dr.full(types.Float, dr.inf, width) for _ in active]

    def going(key: Any, trail: Any, found: Any) -> Any:
        return key != DONE

    def step(key: Any, trail: Any, found: Any) -> tuple[Any, Any, Any]:
        found = list(found)
        for item, number in _leaf(walk, key):
            for k in range(len(found)):
                t = walk.meet(item, k)
                counts = t < dr.inf
                if skips is not None:
                    counts &= ~skips(number, k)
                found[k] = dr.select(counts, t, found[k])
        key, trail = _pop(types, key, trail)
        open_ = types.Bool(False)
        for k, one in enumerate(active):
            open_ = open_ | (one & (found[k] == dr.inf))
        key, trail = _descend(walk, dr.select(open_, key, DONE), trail, farthest)
        return key, trail, found

    *_, found = dr.while_loop(state=(key, trail, found), cond=going, body=step, labels=("key", "trail", "found"))
    return list(found)
