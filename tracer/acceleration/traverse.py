"""Every ray's own way through the tree, without a stack.

The state is the node's heap index `key` and `trail`, one bit per level that says whether the sibling is still to be
visited: to go back, climb to the deepest set bit and turn to the sibling.
"""

from collections.abc import Callable
from typing import Any

import drjit as dr

from tracer.acceleration.boxes import entry, reciprocal
from tracer.acceleration.build import LEAF_SIZE
from tracer.acceleration.forest import Forest
from tracer.rays import Interval, Ray

NONE = 0xFFFFFFFF  # the number of no triangle


def _pop(key: Any, trail: Any) -> tuple[Any, Any]:
    """Return the deepest sibling still to be visited, or key 0 where none is left."""
    levels = dr.tzcnt(trail)
    done = trail == 0
    levels = dr.select(done, 0, levels)
    return dr.select(done, 0, (key >> levels) ^ 1), dr.select(done, 0, (trail >> levels) ^ 1)


class Walk:
    """What one kind of ray needs on its way through one tree."""

    def __init__(self, forest: Forest, ray: Ray, interval: Interval, formula: Callable[..., Any]) -> None:
        self.forest, self.ray, self.interval, self.formula = forest, ray, interval, formula
        self.types = forest.types
        self._inverse = reciprocal(ray.direction)

    def begin(self, active: Any) -> tuple[Any, Any]:
        """Return the state before the first step; rays that are not active have none to make."""
        UInt = self.types.UInt
        width = max(dr.width(self.ray.direction), dr.width(self.ray.origin), dr.width(active))
        # A loop's state must have full width from the start.
        return dr.select(active, dr.full(UInt, 1, width), 0), dr.zeros(UInt, width)

    def _enters(self, node: Any, limit: Any, active: Any) -> tuple[Any, Any]:
        lower, upper = self.forest.box(node, active)
        enter, leave = entry(lower, upper, self.ray.origin, self._inverse, precision=self.types.precision)
        hit = (enter <= leave) & (leave >= self.interval.nearest) & (enter < self.interval.farthest) & (enter <= limit)
        return hit, enter

    def descend(self, key: Any, trail: Any, limit: Any) -> tuple[Any, Any]:
        """Return the next leaf whose box is entered before `limit`, or key 0."""
        leaves = self.forest.leaves

        def inside(key: Any, trail: Any) -> Any:
            return (key != 0) & (key < leaves)

        def step(key: Any, trail: Any) -> tuple[Any, Any]:
            active = inside(key, trail)
            left, right = 2 * key, 2 * key + 1
            hit_left, enter_left = self._enters(left, limit, active)
            hit_right, enter_right = self._enters(right, limit, active)
            both = hit_left & hit_right
            go_right = hit_right & (~hit_left | (enter_right < enter_left))
            popped_key, popped_trail = _pop(key, trail)
            some = hit_left | hit_right
            return (
                dr.select(some, dr.select(go_right, right, left), popped_key),
                dr.select(some, (trail << 1) | dr.select(both, self.types.UInt(1), 0), popped_trail),
            )

        return dr.while_loop(state=(key, trail), cond=inside, body=step, labels=("key", "trail"))

    def leaf(self, key: Any, active: Any) -> list[tuple[Any, Any]]:
        """Return (number, distance) for each slot of a leaf; inf where its triangle is missed."""
        found = []
        for place in range(LEAF_SIZE):
            slot = (key - self.forest.leaves) * LEAF_SIZE + place
            t = self.formula(self.ray, self.forest.triangle(slot, active), self.interval)
            found.append((self.forest.number(slot, active), dr.select(active, t, dr.inf)))
        return found


def nearest(walk: Walk, *, closer: Callable[[Any, Any], Any], limit: Any, active: Any) -> tuple[Any, Any]:
    """Return distance (inf: none up to `limit`) and number of the nearest triangle; at a tie the lower number."""
    types = walk.types
    key, trail = walk.begin(active)
    width = dr.width(key)
    best, number = dr.full(types.Float, dr.inf, width), dr.full(types.UInt, NONE, width)

    def going(key: Any, trail: Any, best: Any, number: Any) -> Any:
        return key != 0

    def step(key: Any, trail: Any, best: Any, number: Any) -> tuple[Any, ...]:
        key, trail = walk.descend(key, trail, dr.select(best < limit, best, limit))
        arrived = key != 0
        for candidate, t in walk.leaf(key, arrived):
            take = closer(t, best) | ((t == best) & (t < dr.inf) & (candidate < number))
            best, number = dr.select(take, t, best), dr.select(take, candidate, number)
        key, trail = _pop(key, trail)
        return key, trail, best, number

    *_, best, number = dr.while_loop(
        state=(key, trail, best, number), cond=going, body=step, labels=("key", "trail", "best", "number")
    )
    return best, number


def any_hit(walk: Walk, *, skip: Any, active: Any) -> Any:
    """Return the distance of some triangle in the interval, inf where there is none; `skip` is a shape or None."""
    types = walk.types
    key, trail = walk.begin(active)
    found = dr.full(types.Float, dr.inf, dr.width(key))

    def going(key: Any, trail: Any, found: Any) -> Any:
        return key != 0

    def step(key: Any, trail: Any, found: Any) -> tuple[Any, Any, Any]:
        key, trail = walk.descend(key, trail, types.Float(dr.inf))
        arrived = key != 0
        for number, t in walk.leaf(key, arrived):
            counts = t < dr.inf
            if skip is not None:
                counts &= walk.forest.shape(number, arrived) != skip
            found = dr.select(counts, t, found)
        key, trail = _pop(key, trail)
        return dr.select(found < dr.inf, 0, key), trail, found

    *_, found = dr.while_loop(state=(key, trail, found), cond=going, body=step, labels=("key", "trail", "found"))
    return found
