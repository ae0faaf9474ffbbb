"""Where a row of items is cut, so that least is met on both sides.

The chance that a ray which meets a box also meets a box inside it is that of their areas. A cut of n items into k and
n - k costs k times the area of the first ones' box and n - k times that of the others'. Of very many cuts some are
compared, and of many items between two of those some stand for all.
Source: MacDonald and Booth, "Heuristics for ray tracing using space subdivision", The Visual Computer 6 (1990); Wald,
"On fast Construction of SAH-based Bounding Volume Hierarchies", IEEE Symposium on Interactive Ray Tracing (2007).
"""

import numpy as np

from rayproof.tracer.acceleration.grid_boxes import AXES, ROW

SAMPLE = 16  # items between two cuts that stand for all
MOST_CUTS = 32  # along an axis; the lower bits of a cost are its number
NEVER = np.uint32(0xFFFFFFFF)  # the cost of a cut that is not allowed


def _areas(rows: np.ndarray, step: np.ndarray) -> np.ndarray:
    """Return half the area of boxes (..., ROW), in steps of the longest axis, float32."""
    # The words of both corners are added four at once: no sum is above STEPS, since no box is inside out.
    corners = rows.view(np.uint64)
    extents = (~(corners[..., 0] + corners[..., 1])).view(np.uint16).reshape(*rows.shape[:-1], ROW // 2)
    x, y, z = (extents[..., axis].astype(np.float32) * step[axis] for axis in range(AXES))
    return x * y + y * z + z * x


def cheapest(
    rows: np.ndarray,
    order: np.ndarray,
    first: np.ndarray,
    counts: np.ndarray,
    *,
    room: int,
    cuts: int,
    step: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Return what the best cut of each row of items costs, and how many items come before it, (n,) each.

    Row i is `counts[i]` items in the order that begins at `order[first[i]]`; no side may have more than `room`. So many
    `cuts` are compared, if `room` has more, and both are powers of two. Costs are uint32 numbers that compare as floats
    do; where no cut is allowed it is NEVER, and all items come before it.
    """
    apart = max(1, room // cuts)  # items from cut to cut
    skip = max(1, apart // SAMPLE)
    most, last = int(counts.max()), first + counts - 1
    kinds = max(1, -(-min(room, most - 1) // apart))

    def boxes(places: np.ndarray) -> np.ndarray:
        return rows.take(order.take(np.minimum(first + places[..., np.newaxis], last)), axis=0)

    # What lies between two cuts, and beyond the last one; then all before a cut, and all behind it.
    left = boxes(np.arange(0, kinds * apart, skip).reshape(kinds, -1).T)
    left = left[0] if len(left) == 1 else left.min(axis=0)
    beyond = np.arange(kinds * apart, most, skip)
    right = np.empty_like(left)
    right[-1] = boxes(beyond).min(axis=0) if len(beyond) else left[-1]
    for k in range(kinds - 1, 0, -1):
        np.minimum(right[k], left[k], out=right[k - 1])
    for k in range(1, kinds):
        np.minimum(left[k - 1], left[k], out=left[k])
    before = apart * np.arange(1, kinds + 1)[:, np.newaxis]
    after = counts - before
    costs = _areas(left, step) * before.astype(np.float32) + _areas(right, step) * after.astype(np.float32)
    # Cost and cut in one number, so that a minimum finds both: floats above 0 are in the order of their bits.
    words = costs.view(np.uint32) & np.uint32(2**32 - MOST_CUTS) | np.arange(kinds, dtype=np.uint32)[:, np.newaxis]
    least = np.where((after > 0) & (after <= room), words, NEVER).min(axis=0)
    return least, np.where(least < NEVER, apart * ((least & np.uint32(MOST_CUTS - 1)).astype(np.int64) + 1), counts)
