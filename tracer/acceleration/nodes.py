"""The boxes of a tree on the device: corners rounded outward to a grid of 2^16 steps per axis, six numbers in 12 bytes.

A coarser box is entered more often and loses nothing; half the memory is worth more than the tighter fit (Mitsuba's
Embree and many others quantise too: Mahovsky and Wyvill, "Memory-Conserving Bounding Volume Hierarchies with Coherent
Raytracing", Computer Graphics Forum 25 (2006)).
"""

from dataclasses import dataclass
from typing import Any

import drjit as dr
import numpy as np

from tracer.acceleration.build import Tree
from tracer.arrays import ArrayTypes
from tracer.assets import Assets, aligned, packets

STEPS = 65535
WORDS = 4  # per box
# Scenes smaller or larger than this [m] would leave float32 in grid space; they are walked without culling.
SMALLEST, LARGEST = 2.0**-80, 2.0**80


@dataclass(frozen=True, kw_only=True)
class HostNodes:
    """The boxes of the children of every inner node, in grid steps from `base`."""

    leaves: int
    words: np.ndarray  # (leaves, 2, WORDS) uint32; row 0 is unused
    base: np.ndarray  # (3,) float64 [m]
    step: np.ndarray  # (3,) float64 [m]
    exact: bool  # whether the grid can be computed with


def _rounded(values: np.ndarray, towards: float) -> np.ndarray:
    """Return float32 numbers, as float64, not on the other side of `values`."""
    near = values.astype(np.float32)
    beyond = near > values if towards < 0 else near < values
    return np.where(beyond, np.nextafter(near, np.float32(towards)), near).astype(np.float64)


def quantise(tree: Tree) -> HostNodes:
    """Return the boxes on the grid that spans them, each corner rounded outward."""
    root = tree.boxes[1].astype(np.float64)
    # Base and step are float32 numbers, so that the device computes with the very grid that the boxes were rounded to.
    base = _rounded(root[:3], -np.inf)
    size = root[3:] - base
    exact = bool(SMALLEST < size.max() < LARGEST and np.abs(root).max() < LARGEST)
    # A flat axis gets a step too. One step is kept free at the upper end for rounding.
    step = _rounded(np.maximum(size, size.max() * 2.0**-20) / (STEPS - 2), np.inf) if exact else np.ones(3)

    def corner(place: int) -> np.ndarray:
        axis, upper = place % 3, place >= 3
        if not exact:
            return np.full(len(tree.boxes), STEPS if upper else 0, dtype=np.uint32)
        scaled = (tree.boxes[:, place].astype(np.float64) - base[axis]) / step[axis]
        # Rounded three times: 2^-30 of a step covers it.
        whole = np.ceil(scaled + 2.0**-30) if upper else np.floor(scaled - 2.0**-30)
        return np.clip(whole, 0, STEPS).astype(np.uint32)

    words = aligned((len(tree.boxes), WORDS), np.uint32)
    for word in range(3):
        words[:, word] = corner(2 * word) | (corner(2 * word + 1) << 16)
    words[:, 3] = 0
    return HostNodes(leaves=tree.leaves, words=words.reshape(tree.leaves, 2, WORDS), base=base, step=step, exact=exact)


def _number(word: Any) -> Any:
    """Return a small UInt as float32. As a signed one: there is an instruction for those."""
    Int: Any = dr.int32_array_t(type(word))
    Single: Any = dr.float32_array_t(type(word))
    return Single(Int(word))


def _low(word: Any) -> Any:
    return _number(word & 0xFFFF)


def _high(word: Any) -> Any:
    return _number(word >> 16)


class Nodes:
    """The boxes as Dr.Jit arrays. Base and step are numbers in memory, so that meshes of one size share a kernel."""

    def __init__(self, host: HostNodes, types: ArrayTypes, assets: Assets, *, name: str) -> None:
        self.host, self.leaves, self.types = host, host.leaves, types
        self.words = assets.upload(f"{name} nodes", types.UInt, lambda: host.words)
        self._grid = assets.floats(f"{name} grid", types, lambda: np.concatenate([host.base, host.step]))

    def _number(self, place: int) -> Any:
        return dr.gather(self.types.Float, self._grid, self.types.UInt(place))

    def point(self, axis: int, coordinate: Any) -> Any:
        """Return a world coordinate [m] in grid steps, float32."""
        # Subtracted in the precision of the coordinate: far from the world's origin the difference is small.
        return self.vector(axis, coordinate - self._number(axis))

    def vector(self, axis: int, component: Any) -> Any:
        """Return a difference of world coordinates [m] in grid steps, float32."""
        Single: Any = dr.float32_array_t(self.types.Float)
        return Single(component) / Single(self._number(3 + axis))

    def children(self, node: Any, active: Any) -> tuple[Any, Any]:
        """Return the boxes of the two children of an inner node, each (lower, upper) with three grid coordinates."""
        a, b, c, _, d, e, f, _ = packets(self.types, self.words, dr.select(active, node, 0), 2)
        return self._box(a, b, c), self._box(d, e, f)

    @staticmethod
    def _box(a: Any, b: Any, c: Any) -> tuple[list[Any], list[Any]]:
        return [_low(a), _high(a), _low(b)], [_high(b), _low(c), _high(c)]
