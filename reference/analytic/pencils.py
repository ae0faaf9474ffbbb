"""Which rays of a pencil may meet which of many small pieces: rays are halved, pieces outside the halves' cones drop.

All rays of a pencil start in one point (the eye, or a light), so a bundle of them lies between four planes through
that point, and a piece wholly outside one of these planes is met by none. Nothing here decides a hit.
"""

from collections.abc import Iterator

import numpy as np

from rayproof.reference.analytic.vectors import cross, length

PAIRS = 1 << 16  # pairs of ray and piece handed out at once: a few megabytes of temporaries
FEW = 24  # pieces below which culling costs more than it saves
# Widens a bundle far beyond float64 roundings, far below a pixel.
SLACK = 1e-9


def bundles(
    directions: np.ndarray, pieces: np.ndarray, margins: np.ndarray | None = None
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield index arrays (rays, pieces) that together hold every pair which may meet.

    `directions` (N, 3) from the pencil's apex; `pieces` (K, corners, 3) relative to it, each the convex hull of its
    corners; `margins` (N,) are lengths by which each direction may be off.
    """
    if margins is None:
        margins = np.zeros(len(directions))
    waiting = [(np.arange(len(directions)), np.arange(len(pieces)))]
    while waiting:
        rays, kept = waiting.pop()
        if len(kept) > FEW and len(rays):
            kept = kept[_may_meet(directions[rays], margins[rays], pieces[kept])]
        if not len(kept) or not len(rays):
            continue
        if len(rays) * len(kept) <= PAIRS or len(rays) == 1:
            yield rays, kept
            continue
        waiting.extend((half, kept) for half in _halves(rays, directions))


def _halves(rays: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Split rays at the median of the coordinate in which their directions differ most."""
    bundle = directions[rays]
    bundle = bundle / length(bundle)[:, np.newaxis]
    widest = np.argmax(np.ptp(bundle, axis=0))
    order = np.argpartition(bundle[:, widest], len(rays) // 2)
    return rays[order[: len(rays) // 2]], rays[order[len(rays) // 2 :]]


def _may_meet(directions: np.ndarray, margins: np.ndarray, pieces: np.ndarray) -> np.ndarray:
    """Return which pieces are not wholly outside one of the planes that bound the bundle, shape (K,)."""
    everything = np.ones(len(pieces), dtype=bool)
    lengths = length(directions)
    axis = (directions / lengths[:, np.newaxis]).mean(axis=0)
    if not np.linalg.norm(axis) > SLACK:
        return everything
    axis = axis / np.linalg.norm(axis)
    depths = directions @ axis
    if not np.all(depths - margins > 1e-2 * lengths):
        return everything
    first = cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    first /= np.linalg.norm(first)
    sides = (first, cross(axis, first))
    # One product for all corners of all pieces: as a stack of small ones it takes ten times as long.
    corner_depths, *both = (np.array([axis, *sides]) @ pieces.reshape(-1, 3).T).reshape(3, *pieces.shape[:2])
    outside = _all_corners(corner_depths < 0)
    signs = (-1, 1) if margins.any() else (0,)
    for side, corner_offsets in zip(sides, both, strict=True):
        offsets = directions @ side
        slopes = np.concatenate([(offsets + a * margins) / (depths + b * margins) for a in signs for b in signs])
        low, high = slopes.min(), slopes.max()
        low, high = low - SLACK * (1 + abs(low)), high + SLACK * (1 + abs(high))
        outside |= _all_corners(corner_offsets < low * corner_depths)
        outside |= _all_corners(corner_offsets > high * corner_depths)
    return ~outside


def _all_corners(mask: np.ndarray) -> np.ndarray:
    """Return mask.all(axis=1), much faster along so short an axis."""
    result = mask[:, 0]
    for corner in range(1, mask.shape[1]):
        result = result & mask[:, corner]
    return result
