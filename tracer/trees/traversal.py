"""Traversal of a tree by a beam: nearest hit and any hit, in nested or pipelined loops.

Which boxes are entered is decided for the bundle (`tracer.trees.beams`); in a leaf every ray meets every
item by the formula that was chosen for it. There are two ways of putting the steps in order, which visit the same
leaves but for those that a hit shortly before has made needless:

* nested: a loop goes down to the next leaf in a loop over leaves. Lanes that have a leaf wait for those that have none.
* pipelined: one loop, whose turns are a step for each lane, and a leaf where any lane has come to one. The boxes of the
  next turn are read before the leaf of this one is tested, so that memory works meanwhile. Where triangles are about as
  small as pixels, the lanes of a packet go to different places, and both is worth more than the steps that go past.

Where a way through a tree stands, in two words: the heap index `key` of a node, and `trail`, what is left to visit.

A node has four children, and trail three bits per level, one for each sibling that is still to be visited: to go back,
climb to the deepest set bit and turn to that sibling. So there is no stack.

Shadow rays of one tile that part: those whose points lie close together go as one beam, one group after the other.

Where a tile shows two surfaces, one behind the other, a single beam from the light to both would meet much of what lies
between them: one tile in a hundred, and most of the work.
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
    """What a bundle needs on its way through one tree: `meet(item, k)` is the t at which its ray k meets an item."""

    hierarchy: Hierarchy
    beam: Beam
    meet: Callable[[Any, int], Any]
    pipelined: bool = False


@dataclass(frozen=True, kw_only=True)
class _Aim:
    """What is looked for on the way: the state is a list of arrays of full width."""

    met: Callable[[Sequence[tuple[Any, Any]], list[Any]], list[Any]]  # (items and numbers of a leaf, state) -> state
    limit: Callable[[list[Any]], Any]  # state -> the t beyond which no box matters, float32
    open: Callable[[list[Any]], Any] | None = None  # state -> whether there is still something to be found


def _descend(walk: Walk, key: Any, trail: Any, limit: Any) -> tuple[Any, Any]:
    """Return the next leaf whose box is entered before `limit`, or key DONE."""
    nodes, types = walk.hierarchy.nodes, walk.hierarchy.types

    def step(key: Any, trail: Any) -> tuple[Any, Any]:
        some, child, others = nearest_child(types, walk.beam.meets(nodes.read(key), limit))
        popped_key, popped_trail = pop(types, key, trail)
        return (
            dr.select(some, (key << 2) | child, popped_key),
            dr.select(some, (trail << 3) | others, popped_trail),
        )

    return dr.while_loop((key, trail), lambda key, _: key < nodes.leaves, step, labels=("key", "trail"))


def _leaf(walk: Walk, key: Any) -> list[tuple[Any, Any]]:
    """Return (item, number) for each slot of the leaf that was reached.

    Lanes that are done look at the first leaf once more. They lose nothing by it, and nobody has to be told apart.
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
        *_, (_, enter), (_, other) = walk.beam.meets(nodes.read(UInt(0)), Single(dr.inf))
        root, trail = (root * 2) | dr.select(other < enter, UInt(1), 0), trail + 1
    return dr.select(active, root, DONE), trail


def _nested(walk: Walk, aim: _Aim, *, key: Any, trail: Any, state: list[Any]) -> list[Any]:
    """Go through a tree from (key, trail), and return the state at the end."""
    # A leaf is reached before the loop and at the end of each round: where there is none, none is looked at.
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
    """Do the same in one loop, whose turns begin with the node's boxes in hand."""
    nodes, types = walk.hierarchy.nodes, walk.hierarchy.types

    def read(key: Any) -> list[Any]:
        return nodes.read(dr.select(key < nodes.leaves, key, 0))

    def turn(key: Any, trail: Any, boxes: Any, state: Any) -> tuple[Any, Any, list[Any], list[Any]]:
        limit = aim.limit(state)
        some, child, others = nearest_child(types, walk.beam.meets(boxes, limit))
        # A lane that stands at a leaf already, or is done, has read boxes that mean nothing.
        some &= key < nodes.leaves
        here = dr.select(some, (key << 2) | child, key)
        at_leaf = (here >= nodes.leaves) & (here != DONE)
        # From a leaf to the next of its siblings, or else from its parent, which does not wait for what was met.
        popped_key, popped_trail = pop(types, key, trail)
        stays, beside = some & ~at_leaf, some & (others != 0)
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
    """Return, per ray, distance (inf: none up to its limit) and number of the nearest item, at a tie the lower one."""
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
                # Where both are inf the number means nothing.
                take = closer(t, best) | ((t == best) & (candidate < number))
                bests[k], numbers[k] = dr.select(take, t, best), dr.select(take, candidate, number)
        return [*bests, *numbers]

    state = [dr.full(types.Float, dr.inf, width) for _ in limits] + [dr.full(types.Int, NONE, width) for _ in limits]
    state = _through(walk, _Aim(met=met, limit=limit), types.Bool(True), state, width)
    return list(zip(state[:count], state[count:], strict=True))


def any_hit(
    walk: Walk, *, farthest: Any, skips: Callable[[Any, int], Any] | None, active: Sequence[Any], width: int
) -> list[Any]:
    """Return, per ray, the distance of some item that it meets, inf where there is none.

    `farthest` bounds the beam's t (float32); `skips(number, k)` says which items ray k leaves out.
    """
    types = walk.hierarchy.types

    def met(items: Sequence[tuple[Any, Any]], state: list[Any]) -> list[Any]:
        found = list(state)
        for item, number in items:
            for k in range(len(found)):
                t = walk.meet(item, k)
                counts = t < dr.inf
                if skips is not None:
                    counts &= ~skips(number, k)
                found[k] = dr.select(counts, t, found[k])
        return found

    def is_open(state: list[Any]) -> Any:
        return reduced(operator.or_, [one & (t == dr.inf) for one, t in zip(active, state, strict=True)])

    aim = _Aim(met=met, limit=lambda state: farthest, open=is_open)
    anyone = reduced(operator.or_, active)
    return _through(walk, aim, anyone, [dr.full(types.Float, dr.inf, width) for _ in active], width)


DONE = 0xFFFFFFFF  # the node of those that are done
# What is pending on a level are the siblings x = 1 .. 3 of the current child, counted by exclusive or: bit x - 1. Of
# the eight combinations, the one to turn to, and what is then pending as seen from there.
FIRST = (0, 1, 2, 1, 3, 1, 2, 1)
REST = (0, 0, 0, 4, 0, 2, 1, 6)


def _below(types: ArrayTypes, table: Sequence[int], place: Any) -> Any:
    """Return an entry below 16 of a table of eight: one word that is shifted."""
    word = sum(entry << (4 * k) for k, entry in enumerate(table))
    return (types.UInt(word) >> (place << 2)) & 15


def pop(types: ArrayTypes, key: Any, trail: Any) -> tuple[Any, Any]:
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


def nearest_child(types: ArrayTypes, met: Sequence[tuple[Any, Any]]) -> tuple[Any, Any, Any]:
    """Return whether any of four children is met, the nearest of them, and the others relative to it."""
    UInt = types.UInt
    Int: Any = dr.int32_array_t(UInt)
    # Floats from 0 on are in the order of their bits, whose lowest two make room for the child.
    entries = [dr.select(hit, Int(dr.reinterpret_array(Int, t)) & ~3 | k, NONE) for k, (hit, t) in enumerate(met)]
    nearest = reduced(smaller, entries)
    child = UInt(nearest) & 3
    others = [dr.select(hit, UInt(1) << (child ^ k), 0) for k, (hit, _) in enumerate(met)]
    return nearest != NONE, child, reduced(operator.or_, others) >> 1


# A group spans at most so many times what the tile would if all neighbours were as close as the closest two, and what
# it would if it faced the eye: where the closest two are far apart, one beam would meet what lies between; measured.
APART, FACING = 2.0, 4.0


def _apart(a: Any, b: Any) -> Any:
    """Return the largest difference of two points' coordinates."""
    x, y, z = abs(a - b)
    return larger(larger(x, y), z)


def _closest(points: Sequence[Any], active: Sequence[Any], columns: int) -> Any:
    """Return how close together the closest two neighbours of a tile lie; without any, inf."""
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
    """Return what `any_hit` returns for rays from `points` [m], a tile row by row.

    Rays in a group have the same masks `alike`; `walk(group, alike)` is the way of one group, and the t of its end.
    Seen from `eye` [m], neighbouring samples lie `sample` apart, per unit of distance.
    """
    if len(points) == 1:
        single, farthest = walk(active, alike[0])
        return any_hit(single, farthest=farthest, skips=skips, active=active, width=width)
    across = columns - 1 + len(points) // columns - 1  # from corner to corner, in samples
    limit = _closest(points, active, columns) * (across * APART)
    found = [dr.full(types.Float, dr.inf, width) for _ in active]
    waiting = [dr.full(types.Bool, True, width) & one for one in active]

    def going(waiting: Any, found: Any) -> Any:
        return reduced(operator.or_, waiting)

    def step(waiting: Any, found: Any) -> tuple[Any, Any]:
        seed, like = points[-1], list(alike[-1])
        for one, point, masks in zip(waiting[-2::-1], points[-2::-1], alike[-2::-1], strict=True):
            seed = dr.select(one, point, seed)
            like = [dr.select(one, mask, before) for mask, before in zip(masks, like, strict=True)]
        widest = smaller(_apart(seed, eye) * sample * (across * FACING), limit)
        group = []
        for one, point, masks in zip(waiting, points, alike, strict=True):
            # Compared this way around a point that is no number joins, and somebody always leaves.
            joins = one & ~(_apart(point, seed) > widest)
            for mask, other in zip(masks, like, strict=True):
                joins &= ~(mask ^ other)
            group.append(joins)
        way, farthest = walk(group, like)
        met = any_hit(way, farthest=farthest, skips=skips, active=group, width=width)
        found = [dr.select(one, t, before) for one, t, before in zip(group, met, found, strict=True)]
        return [one & ~other for one, other in zip(waiting, group, strict=True)], found

    _, found = dr.while_loop(state=(waiting, found), cond=going, body=step, labels=("waiting", "found"))
    return list(found)
