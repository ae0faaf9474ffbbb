"""Traversal of a tree by a beam: nearest hit and any hit, in nested or pipelined loops.

A box is entered if the beam hits it (`tracer.trees.beams`); in a leaf every ray is tested against every item by the
configured formula. There are two orders of the steps, which visit the same leaves, except for leaves that became
unnecessary by a hit shortly before:

* nested: within a loop over leaves, an inner loop descends to the next leaf. Lanes at a leaf wait for the others.
* pipelined: one loop, whose turn is a step in each lane, and a leaf test if any lane is at a leaf. The boxes of the
  next turn are read before the leaf is tested, so that both overlap. If triangles are about as small as pixels, the
  lanes of a packet are at different nodes, and the overlap is worth more than the skipped steps.

The state of a traversal is two words: the heap index `key` of a node, and `trail`, the nodes that are left to visit.

A node has four children, and `trail` has three bits per level, one for each sibling that is still to be visited: to go
back, ascend to the deepest set bit and turn to that sibling. So there is no stack.

Shadow rays of one tile are split into groups: rays whose points are close together are one beam, one group after the
other. If a tile shows two surfaces, one behind the other, a single beam from the light to both would hit most of the
shapes between them: one tile in a hundred, and most of the work.
"""

import operator
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import drjit as dr

from rayproof.tracer.configuration import Configuration
from rayproof.tracer.kernel.arithmetic import larger, smaller
from rayproof.tracer.kernel.arrays import ArrayTypes, where
from rayproof.tracer.rays import Interval, Ray
from rayproof.tracer.trees.beams import Beam, reduced
from rayproof.tracer.trees.boxes import Nodes

NONE = 0x7FFFFFFF  # the number of no item
# A bound of float64 is compared in float32, rounded up by more than the conversion may round down.
WIDER = 1 + 2.0**-22


class Hierarchy(Protocol):
    """Items of one kind in a tree."""

    nodes: Nodes
    types: ArrayTypes

    def item(self, slot: Any) -> tuple[Any, Any]:
        """Return the item in a slot of a leaf, and its number."""
        ...

    def meet(self, configuration: Configuration, ray: Ray, item: Any, interval: Interval) -> Any:
        """Return the t at which a ray meets an item, or inf."""

    def shape(self, number: Any, active: Any) -> Any:
        """Return the index of the shape that an item belongs to."""

    def face(self, number: Any, active: Any) -> Any:
        """Return an item's face index in its shape."""


@dataclass(frozen=True, kw_only=True)
class Walk:
    """The inputs of a bundle's traversal of one tree: `meet(item, k)` is the t at which its ray k hits an item."""

    hierarchy: Hierarchy
    beam: Beam
    meet: Callable[[Any, int], Any]
    pipelined: bool = False


@dataclass(frozen=True, kw_only=True)
class _Aim:
    """The query of a traversal, nearest hit or any hit: its state is a list of arrays of full width."""

    met: Callable[[Sequence[tuple[Any, Any]], list[Any]], list[Any]]  # (items and numbers of a leaf, state) -> state
    limit: Callable[[list[Any]], Any]  # state -> the t beyond which boxes are skipped, float32
    open: Callable[[list[Any]], Any] | None = None  # state -> mask of lanes that need further items


def _descend(walk: Walk, key: Any, trail: Any, limit: Any) -> tuple[Any, Any]:
    """Return the next leaf whose box is entered before `limit`, or key DONE."""
    nodes, types = walk.hierarchy.nodes, walk.hierarchy.types

    def step(key: Any, trail: Any) -> tuple[Any, Any]:
        entered, child, others = nearest_child(types, walk.beam.meets(nodes.read(key), limit))
        popped_key, popped_trail = pop(types, key, trail)
        return (
            dr.select(entered, (key << 2) | child, popped_key),
            dr.select(entered, (trail << 3) | others, popped_trail),
        )

    return dr.while_loop((key, trail), lambda key, _: key < nodes.leaves, step, labels=("key", "trail"))


def _leaf(walk: Walk, key: Any) -> list[tuple[Any, Any]]:
    """Return (item, number) for each slot of the current leaf.

    Lanes that are done test the first leaf once more, which does not change their result and needs no mask.
    """
    nodes = walk.hierarchy.nodes
    leaf = dr.select(key == DONE, 0, key - nodes.leaves)
    return [walk.hierarchy.item(slot) for slot in nodes.slots(leaf)]


def _begin(walk: Walk, active: Any, width: int) -> tuple[Any, Any]:
    """Return the state before the first step; a loop's state must have full width from the start."""
    types, nodes = walk.hierarchy.types, walk.hierarchy.nodes
    UInt = types.UInt
    root, trail = dr.full(UInt, 1, width), dr.zeros(UInt, width)
    if nodes.halves:
        # Both halves are visited, the nearer one first.
        Single: Any = dr.float32_array_t(types.Float)
        *_, (_, enter), (_, exit) = walk.beam.meets(nodes.read(UInt(0)), Single(dr.inf))
        root, trail = (root * 2) | dr.select(exit < enter, UInt(1), 0), trail + 1
    return dr.select(active, root, DONE), trail


def _nested(walk: Walk, aim: _Aim, *, key: Any, trail: Any, state: list[Any]) -> list[Any]:
    """Traverse a tree from (key, trail) in nested loops, and return the state at the end."""
    # The next leaf is reached before the loop and at the end of each round, so that every round tests a leaf.
    key, trail = _descend(walk, key, trail, aim.limit(state))

    def step(key: Any, trail: Any, state: Any) -> tuple[Any, Any, list[Any]]:
        state = aim.met(_leaf(walk, key), list(state))
        key, trail = pop(walk.hierarchy.types, key, trail)
        if aim.open is not None:
            key = dr.select(aim.open(state), key, DONE)
        key, trail = _descend(walk, key, trail, aim.limit(state))
        return key, trail, state

    *_, state = dr.while_loop(
        state=(key, trail, state),
        cond=lambda key, trail, state: key != DONE,
        body=step,
        labels=("key", "trail", "state"),
    )
    return list(state)


def _pipelined(walk: Walk, aim: _Aim, *, key: Any, trail: Any, state: list[Any]) -> list[Any]:
    """Do the same in a single loop; the boxes of a round's node have been read in the round before."""
    nodes, types = walk.hierarchy.nodes, walk.hierarchy.types

    def read(key: Any) -> list[Any]:
        return nodes.read(dr.select(key < nodes.leaves, key, 0))

    def turn(key: Any, trail: Any, boxes: Any, state: Any) -> tuple[Any, Any, list[Any], list[Any]]:
        limit = aim.limit(state)
        entered, child, others = nearest_child(types, walk.beam.meets(boxes, limit))
        # A lane that is at a leaf already, or is done, has read the boxes of node 0, which are ignored.
        entered &= key < nodes.leaves
        here = dr.select(entered, (key << 2) | child, key)
        at_leaf = (here >= nodes.leaves) & (here != DONE)
        # The node after a leaf does not depend on the hits in the leaf.
        popped_key, popped_trail = pop(types, key, trail)
        stays, beside = entered & ~at_leaf, entered & (others != 0)
        key = dr.select(stays, here, dr.select(beside, here ^ _below(types, FIRST, others), popped_key))
        rest = dr.select(stays, others, _below(types, REST, others))
        trail = dr.select(stays | beside, (trail << 3) | rest, popped_trail)
        # Both are read before the leaf is tested.
        boxes, items = read(key), _leaf(walk, dr.select(at_leaf, here, DONE))
        state = where(at_leaf, lambda: aim.met(items, list(state)), list(state))
        if aim.open is not None:
            key = dr.select(aim.open(state), key, DONE)
        return key, trail, boxes, state

    *_, state = dr.while_loop(
        state=(key, trail, read(key), state),
        cond=lambda key, trail, boxes, state: key != DONE,
        body=turn,
        labels=("key", "trail", "boxes", "state"),
    )
    return list(state)


def _through(walk: Walk, aim: _Aim, active: Any, state: list[Any], width: int) -> list[Any]:
    key, trail = _begin(walk, active, width)
    return (_pipelined if walk.pipelined else _nested)(walk, aim, key=key, trail=trail, state=state)


def nearest(
    walk: Walk, *, closer: Callable[[Any, Any], Any], limits: Sequence[Any], width: int
) -> list[tuple[Any, Any]]:
    """Return, per ray, distance (inf: none up to its limit) and number of the nearest item, the lower one at a tie."""
    types, count = walk.hierarchy.types, len(limits)
    Single: Any = dr.float32_array_t(types.Float)

    def limit(state: list[Any]) -> Any:
        farthest = reduced(larger, [smaller(*pair) for pair in zip(state[:count], limits, strict=True)])
        return Single(farthest) * WIDER if types.precision == "float64" else farthest

    def met(items: Sequence[tuple[Any, Any]], state: list[Any]) -> list[Any]:
        bests, numbers = state[:count], state[count:]
        for item, candidate in items:
            for k, (best, number) in enumerate(zip(bests, numbers, strict=True)):
                t = walk.meet(item, k)
                # If both are inf, the number is ignored.
                take = closer(t, best) | ((t == best) & (candidate < number))
                bests[k], numbers[k] = dr.select(take, t, best), dr.select(take, candidate, number)
        return [*bests, *numbers]

    state = [dr.full(types.Float, dr.inf, width) for _ in limits] + [dr.full(types.Int, NONE, width) for _ in limits]
    state = _through(walk, _Aim(met=met, limit=limit), types.Bool(True), state, width)
    return list(zip(state[:count], state[count:], strict=True))


def any_hit(
    walk: Walk, *, farthest: Any, skips: Callable[[Any, int], Any] | None, active: Sequence[Any], width: int
) -> list[Any]:
    """Return, per ray, the distance of some item that it hits, or inf.

    `farthest` bounds the beam's t (float32); `skips(number, k)` returns whether ray k ignores an item.
    """
    types = walk.hierarchy.types

    def met(items: Sequence[tuple[Any, Any]], state: list[Any]) -> list[Any]:
        distances = list(state)
        for item, number in items:
            for k in range(len(distances)):
                t = walk.meet(item, k)
                counts = t < dr.inf
                if skips is not None:
                    counts &= ~skips(number, k)
                distances[k] = dr.select(counts, t, distances[k])
        return distances

    def is_open(state: list[Any]) -> Any:
        return reduced(operator.or_, [mask & (t == dr.inf) for mask, t in zip(active, state, strict=True)])

    aim = _Aim(met=met, limit=lambda state: farthest, open=is_open)
    anyone = reduced(operator.or_, active)
    return _through(walk, aim, anyone, [dr.full(types.Float, dr.inf, width) for _ in active], width)


DONE = 0xFFFFFFFF  # the node of lanes that are done
# The pending siblings x = 1 .. 3 of a level, relative to the current child by exclusive or, are the bits x - 1. For
# each of the eight combinations: the sibling to turn to, and the pending siblings relative to it.
FIRST = (0, 1, 2, 1, 3, 1, 2, 1)
REST = (0, 0, 0, 4, 0, 2, 1, 6)


def _below(types: ArrayTypes, table: Sequence[int], place: Any) -> Any:
    """Return an entry below 16 of a table of eight: one word that is shifted."""
    word = sum(entry << (4 * k) for k, entry in enumerate(table))
    return (types.UInt(word) >> (place << 2)) & 15


def pop(types: ArrayTypes, key: Any, trail: Any) -> tuple[Any, Any]:
    """Return the deepest node still to be visited, or key DONE if none is left."""
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


def nearest_child(types: ArrayTypes, hits: Sequence[tuple[Any, Any]]) -> tuple[Any, Any, Any]:
    """Return whether any of four children is hit, the nearest hit child, and the others relative to it."""
    UInt = types.UInt
    Int: Any = dr.int32_array_t(UInt)
    # Floats from 0 on are in the order of their bits, whose lowest two make room for the child.
    entries = [dr.select(hit, Int(dr.reinterpret_array(Int, t)) & ~3 | k, NONE) for k, (hit, t) in enumerate(hits)]
    nearest = reduced(smaller, entries)
    child = UInt(nearest) & 3
    others = [dr.select(hit, UInt(1) << (child ^ k), 0) for k, (hit, _) in enumerate(hits)]
    return nearest != NONE, child, reduced(operator.or_, others) >> 1


# The largest extent of a group: in multiples of the tile's extent if all neighbours were as close as the closest two,
# and of its extent if it faced the eye. If the closest two are far apart, a beam would hit the shapes between them;
# measured.
APART, FACING = 2.0, 4.0


def _apart(a: Any, b: Any) -> Any:
    """Return the largest difference of two points' coordinates."""
    x, y, z = abs(a - b)
    return larger(larger(x, y), z)


def _closest(points: Sequence[Any], active: Sequence[Any], columns: int) -> Any:
    """Return the distance between the closest two neighbours of a tile; inf without neighbours."""
    pairs = [(k, k + 1) for k in range(len(points)) if (k + 1) % columns]
    pairs += [(k, k + columns) for k in range(len(points) - columns)]
    apart = [dr.select(active[a] & active[b], _apart(points[a], points[b]), dr.inf) for a, b in pairs]
    return reduced(smaller, apart)


def any_hit_in_groups(
    types: ArrayTypes,
    walk: Callable[[Sequence[Any], Sequence[Any]], tuple[Walk, Any]],
    *,
    points: Sequence[Any],
    alike: Sequence[Sequence[Any]],
    columns: int,
    eye: Any,
    sample: Any,
    skips: Callable[[Any, int], Any] | None,
    active: Sequence[Any],
    width: int,
) -> list[Any]:
    """Return the results of `any_hit` for rays from `points` [m], a tile row by row.

    Rays in a group have the same masks `alike`; `walk(group, alike)` returns the traversal of one group, and the t of
    its end. Neighbouring samples are `sample` apart as seen from `eye` [m], per unit of distance.
    """
    if len(points) == 1:
        single, farthest = walk(active, alike[0])
        return any_hit(single, farthest=farthest, skips=skips, active=active, width=width)
    across = columns - 1 + len(points) // columns - 1  # from corner to corner, in samples
    limit = _closest(points, active, columns) * (across * APART)
    found = [dr.full(types.Float, dr.inf, width) for _ in active]
    waiting = [dr.full(types.Bool, True, width) & mask for mask in active]

    def going(waiting: Any, nearest_so_far: Any) -> Any:
        return reduced(operator.or_, waiting)

    def step(waiting: Any, nearest_so_far: Any) -> tuple[Any, Any]:
        seed, like = points[-1], list(alike[-1])
        for ray_waits, point, masks in zip(waiting[-2::-1], points[-2::-1], alike[-2::-1], strict=True):
            seed = dr.select(ray_waits, point, seed)
            like = [dr.select(ray_waits, mask, before) for mask, before in zip(masks, like, strict=True)]
        widest = smaller(_apart(seed, eye) * sample * (across * FACING), limit)
        group = []
        for ray_waits, point, masks in zip(waiting, points, alike, strict=True):
            # With this comparison a NaN point joins the group, so that every turn removes at least one ray.
            joins = ray_waits & ~(_apart(point, seed) > widest)
            for mask, reached in zip(masks, like, strict=True):
                joins &= ~(mask ^ reached)
            group.append(joins)
        way, farthest = walk(group, like)
        distances = any_hit(way, farthest=farthest, skips=skips, active=group, width=width)
        nearest_so_far = [
            dr.select(ray_waits, t, before)
            for ray_waits, t, before in zip(group, distances, nearest_so_far, strict=True)
        ]
        return [ray_waits & ~reached for ray_waits, reached in zip(waiting, group, strict=True)], nearest_so_far

    _, found = dr.while_loop(state=(waiting, found), cond=going, body=step, labels=("waiting", "found"))
    return list(found)
