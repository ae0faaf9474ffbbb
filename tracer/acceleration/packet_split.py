"""Feelers of one tile that part: those whose points lie close together go as one beam, one group after the other.

Where a tile shows two surfaces, one behind the other, a single beam from the light to both would meet much of what lies
between them: one tile in a hundred, and most of the work.
"""

from collections.abc import Callable, Sequence
from typing import Any

import drjit as dr

from rayproof.tracer.acceleration.packet_bounds import larger, reduced, smaller
from rayproof.tracer.acceleration.traversal import Walk, any_hit
from rayproof.tracer.kernel.arrays import ArrayTypes

APART = 2.0  # times what a tile spans whose neighbours are all as close as the closest two; measured


def _apart(a: Any, b: Any) -> Any:
    """Return the largest difference of two points' coordinates."""
    x, y, z = abs(a - b)
    return larger(larger(x, y), z)


def _span(points: Sequence[Any], active: Sequence[Any], columns: int) -> Any:
    """Return what the tile would span if all its points lay as close together as the closest two neighbours do."""
    pairs = [(k, k + 1) for k in range(len(points)) if (k + 1) % columns]
    pairs += [(k, k + columns) for k in range(len(points) - columns)]
    apart = [dr.select(active[a] & active[b], _apart(points[a], points[b]), dr.inf) for a, b in pairs]
    return reduced(smaller, apart) * (columns - 1 + len(points) // columns - 1)


def any_hit_in_groups(
    types: ArrayTypes,
    walk: Callable[[Sequence[Any], Sequence[Any]], tuple[Walk, Any]],
    *,
    points: Sequence[Any],
    alike: Sequence[Sequence[Any]],
    columns: int,
    skips: Callable[[Any, int], Any] | None,
    active: Sequence[Any],
    width: int,
) -> list[Any]:
    """Return what `any_hit` returns for rays from `points` [m], a tile row by row.

    Rays in a group have the same masks `alike`; `walk(group, alike)` is the way of one group, and the t of its end.
    """
    if len(points) == 1:
        single, farthest = walk(active, alike[0])
        return any_hit(single, farthest=farthest, skips=skips, active=active, width=width)
    limit = _span(points, active, columns) * APART
    found = [dr.full(types.Float, dr.inf, width) for _ in active]
    waiting = [dr.full(types.Bool, True, width) & one for one in active]

    def going(waiting: Any, found: Any) -> Any:
        anyone = waiting[0]
        for one in waiting[1:]:
            anyone = anyone | one
        return anyone

    def step(waiting: Any, found: Any) -> tuple[Any, Any]:
        seed, like = points[-1], list(alike[-1])
        for one, point, masks in zip(waiting[-2::-1], points[-2::-1], alike[-2::-1], strict=True):
            seed = dr.select(one, point, seed)
            like = [dr.select(one, mask, before) for mask, before in zip(masks, like, strict=True)]
        group = []
        for one, point, masks in zip(waiting, points, alike, strict=True):
            # Compared this way around a point that is no number joins, and somebody always leaves.
            joins = one & ~(_apart(point, seed) > limit)
            for mask, other in zip(masks, like, strict=True):
                joins &= ~(mask ^ other)
            group.append(joins)
        way, farthest = walk(group, like)
        met = any_hit(way, farthest=farthest, skips=skips, active=group, width=width)
        found = [dr.select(one, t, before) for one, t, before in zip(group, met, found, strict=True)]
        return [one & ~other for one, other in zip(waiting, group, strict=True)], found

    _, found = dr.while_loop(state=(waiting, found), cond=going, body=step, labels=("waiting", "found"))
    return list(found)
