"""The boxes of a tree's items on the grid of its nodes: corners rounded outward, once, to 2^16 steps per axis.

The box about several items is then the minimum of small integers, by which the tree is built and its nodes are written:
no rounding is left that a node would need room for.
"""

from dataclasses import dataclass

import numpy as np

from rayproof.tracer.shapes.triangles import in_pieces

STEPS = 65535
AXES = 3
# Scenes smaller or larger than this [m] would leave float32 in grid space; they are walked without culling.
SMALLEST, LARGEST = 2.0**-80, 2.0**80
LOWER, UPPER = 0, 4  # where the coordinates of the two corners begin in a row
ROW = 8  # words of 16 bits: two rows of three and a spare one, which numpy moves as one number of 16 bytes


@dataclass(frozen=True, kw_only=True)
class GridBoxes:
    """Boxes in grid steps from `base`."""

    # (n, ROW) uint16: the lower corner counted from the grid's lower end, the upper one downward from its upper end, so
    # that the row of the box about several is the minimum of theirs.
    rows: np.ndarray
    base: np.ndarray  # (3,) float64 [m]
    step: np.ndarray  # (3,) float64 [m]
    exact: bool  # whether the grid can be computed with; if not, each box is the whole grid


def _rounded(values: np.ndarray, towards: float) -> np.ndarray:
    """Return float32 numbers, as float64, not on the other side of `values`."""
    near = values.astype(np.float32)
    beyond = near > values if towards < 0 else near < values
    return np.where(beyond, np.nextafter(near, np.float32(towards)), near).astype(np.float64)


def on_grid(lower: np.ndarray, upper: np.ndarray) -> GridBoxes:
    """Return boxes by their corners (3, n) [m], rounded outward to the grid that spans them.

    Raises:
        ValueError: there is no box.

    """
    if lower.shape[1] == 0:
        raise ValueError("a tree needs at least one item")
    ends = np.array([lower.min(axis=1), upper.max(axis=1)], dtype=np.float64)
    # Base and step are float32 numbers, so that the device computes with the very grid that the boxes were rounded to.
    base = _rounded(ends[0], -np.inf)
    size = ends[1] - base
    exact = bool(SMALLEST < size.max() < LARGEST and np.abs(ends).max() < LARGEST)
    rows = np.zeros((lower.shape[1], ROW), dtype=np.uint16)
    if not exact:
        return GridBoxes(rows=rows, base=base, step=np.ones(AXES), exact=False)
    # A flat axis gets a step too. One step is kept free at the upper end for rounding.
    step = _rounded(np.maximum(size, size.max() * 2.0**-20) / (STEPS - 2), np.inf)

    def work(piece: slice) -> None:
        for axis in range(AXES):
            # Rounded three times: 2^-30 of a step covers it.
            low = np.floor((lower[axis, piece].astype(np.float64) - base[axis]) / step[axis] - 2.0**-30)
            high = np.ceil((upper[axis, piece].astype(np.float64) - base[axis]) / step[axis] + 2.0**-30)
            rows[piece, LOWER + axis] = np.clip(low, 0, STEPS)
            rows[piece, UPPER + axis] = STEPS - np.clip(high, 0, STEPS)

    in_pieces(len(rows), work)
    return GridBoxes(rows=rows, base=base, step=step, exact=True)
