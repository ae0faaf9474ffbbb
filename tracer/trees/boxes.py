"""Boxes of a tree's nodes: on a 16-bit grid on the host, and as packets on the device.

Corners are rounded outward, once, to a grid of 2^16 steps per axis. The box about several items is then the minimum of
small integers, from which the tree is built and its nodes are written.

On the device four boxes of a tree are read at once, those of a node's grandchildren in the binary heap, as one packet
of 32 bytes. It holds the lower corner of the box about all four, the size of its 255 steps in grid steps (a power of
two per axis), and the corners of the four boxes, rounded outward once more, in a byte per coordinate.

A coarser box is entered more often but misses nothing; less memory is worth more than a tighter fit (Mahovsky and
Wyvill, "Memory-Conserving Bounding Volume Hierarchies with Coherent Raytracing", Computer Graphics Forum 25 (2006)).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import drjit as dr
import numpy as np

from rayproof.tracer.kernel.arrays import ArrayTypes
from rayproof.tracer.kernel.parameters import DeviceBuffers, KernelConstants, aligned
from rayproof.tracer.shapes.meshes import in_pieces

STEPS = 65535  # of the grid in which boxes are stored: the largest number of 16 bits
AXES = 3
# Scenes smaller or larger than this [m] would leave float32 in grid space; they are traversed without culling.
SMALLEST, LARGEST = 2.0**-80, 2.0**80
LOWER, UPPER = 0, 4  # where the coordinates of the two corners begin in a row
ROW = 8  # words of 16 bits: two rows of three and a spare one, which numpy moves as one number of 16 bytes


@dataclass(frozen=True, kw_only=True)
class GridBoxes:
    """Boxes in grid steps from `base`."""

    # (n, ROW) uint16: the lower corner counted from the grid's lower end, the upper one downward from its upper end, so
    # that the row of the box about several boxes is the minimum of their rows.
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
            # A margin of 2^-30 of a grid step covers the three roundings of a corner.
            low = np.floor((lower[axis, piece].astype(np.float64) - base[axis]) / step[axis] - 2.0**-30)
            high = np.ceil((upper[axis, piece].astype(np.float64) - base[axis]) / step[axis] + 2.0**-30)
            rows[piece, LOWER + axis] = np.clip(low, 0, STEPS)
            rows[piece, UPPER + axis] = STEPS - np.clip(high, 0, STEPS)

    in_pieces(len(rows), work)
    return GridBoxes(rows=rows, base=base, step=step, exact=True)


CHILDREN = 4
FINEST = 255  # the most steps of a node along each axis
NODE = 8  # words of a node; its bytes are three lower coordinates of each child, then three upper ones
CORNER, SHIFTS = 12, 15  # 16-bit words of a node: three of its lower corner, and one of its steps, 4 bits per axis
SHIFT = np.frexp((np.maximum(np.arange(STEPS + 1), 1) - 1) // FINEST)[1]  # for the length of a node in steps


@dataclass(frozen=True, kw_only=True)
class Tree:
    """The order of the items in the leaves. Leaf i has the slots from i total / leaves to (i + 1) total / leaves."""

    leaves: int  # a power of two
    size: int  # slots of the largest leaf
    total: int  # slots
    slots: np.ndarray  # (total + size - 1,) int32, index of the item in each slot; the last one repeats
    empty: np.ndarray  # (leaves,) bool, leaves without items

    def first(self, leaf: np.ndarray) -> np.ndarray:
        """Return the first slot of a leaf, counted from 0; of `leaves` the end."""
        return leaf.astype(np.int64) * self.total // self.leaves


@dataclass(frozen=True, kw_only=True)
class HostNodes:
    """The boxes of the four children of every inner node of every other level, in grid steps from `base`.

    Node i of the binary heap has the children 4 i .. 4 i + 3; if the number of levels is odd, the upper two roots 2 and
    3 are in row 0. Some rows between the levels are unused.
    """

    leaves: int
    size: int  # slots of the largest leaf
    total: np.ndarray  # (1,) uint32, slots
    words: np.ndarray  # (rows, NODE) uint32
    base: np.ndarray  # (3,) float64 [m]
    step: np.ndarray  # (3,) float64 [m]
    exact: bool  # whether the grid can be computed with


def quantise(tree: Tree, boxes: GridBoxes) -> HostNodes:
    """Return the boxes of a tree's nodes, each the smallest box on the grid about the boxes of its items."""
    words = aligned((max(1, tree.leaves // 2), NODE), np.uint32)
    words[0] = 0
    first = tree.first(np.arange(tree.leaves + 1))
    leaves = boxes.rows.take(tree.slots[first[:-1]], axis=0)
    for place in range(1, tree.size):
        others = boxes.rows.take(tree.slots[np.minimum(first[:-1] + place, first[1:] - 1)], axis=0)
        np.minimum(leaves, others, out=leaves)
    # The box of a leaf without items is inside out: it enlarges no other box, and no narrow beam hits it.
    leaves[tree.empty] = STEPS
    for axis in range(AXES):
        level = np.stack([leaves[:, LOWER + axis], leaves[:, UPPER + axis]])
        count = tree.leaves
        while count > 1:
            if count == 2:
                level = np.tile(level, 2)
            children = level
            for _ in range(2):
                level = np.minimum(level[:, ::2], level[:, 1::2])
            _write(words[count // 4 : max(1, count // 2)], axis, children, level)
            count //= 4
    return HostNodes(
        leaves=tree.leaves,
        size=tree.size,
        total=np.array([tree.total], dtype=np.uint32),
        words=words,
        base=boxes.base,
        step=boxes.step,
        exact=boxes.exact,
    )


def _write(words: np.ndarray, axis: int, children: np.ndarray, level: np.ndarray) -> None:
    """Write the coordinates of children along an axis, (2, CHILDREN n), into nodes (n, NODE), whose own are `level`."""
    octets, numbers = words.view(np.uint8).reshape(len(words), -1, CHILDREN), words.view(np.uint16)

    def work(piece: slice) -> None:
        low, upper = (rows.reshape(-1, CHILDREN)[piece].astype(np.int32) for rows in children)
        corner, end = level[0, piece, np.newaxis], level[1, piece, np.newaxis]
        shift = SHIFT.take(STEPS - np.minimum(end, STEPS - corner) - corner)
        void, high = low + upper > STEPS, STEPS - upper
        octets[piece, axis] = np.where(void, FINEST, (low - corner) >> shift)
        octets[piece, AXES + axis] = np.where(void, 0, -((corner - high) >> shift))
        numbers[piece, CORNER + axis] = corner[:, 0]
        numbers[piece, SHIFTS] = (shift[:, 0] << 4 * axis) | (numbers[piece, SHIFTS] if axis else 0)

    in_pieces(len(words), work)


def _number(word: Any, first: int, count: int = 16) -> Any:
    """Return some bits of a UInt as float32. By way of a signed number: there is an instruction for those."""
    Int: Any = dr.int32_array_t(type(word))
    Single: Any = dr.float32_array_t(type(word))
    return Single(Int((word >> first) & ((1 << count) - 1)))


class Nodes:
    """The boxes as Dr.Jit arrays. Base and step are numbers in memory, so that meshes of one size share a kernel."""

    def __init__(
        self, host: HostNodes, types: ArrayTypes, buffers: DeviceBuffers, *, name: str, parameters: KernelConstants
    ) -> None:
        self.host, self.size, self.types = host, host.size, types
        # A scene that is rendered once shares its kernels with trees of any number of leaves.
        self.leaves = parameters(f"{name} leaves", types.UInt(host.leaves))
        self._shift = parameters(f"{name} shift", types.UInt(33 - host.leaves.bit_length()))
        self.words = buffers.upload(f"{name} nodes", types.UInt, lambda: host.words)
        self._total = buffers.upload(f"{name} slots", types.UInt, lambda: host.total)
        self._grid = buffers.floats(f"{name} grid", types, lambda: np.concatenate([host.base, host.step]))

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

    def read(self, node: Any) -> list[Any]:
        """Return the words with the boxes of an inner node's children."""
        Packet: Any = dr.replace_type_t(self.types.Packet, dr.VarType.UInt32)
        return list(dr.gather(Packet, self.words, node, shape=(NODE, dr.width(node))))

    @property
    def halves(self) -> bool:
        """Return whether there are two roots, the nodes 2 and 3, instead of one, node 1."""
        return self.host.leaves.bit_length() % 2 == 0

    def slots(self, leaf: Any) -> list[Any]:
        """Return the slots of a leaf, counted from 0; the last slot of a smaller leaf is the next leaf's first."""
        if self.host.leaves == 1:
            return [self.types.UInt(place) for place in range(self.size)]
        total = dr.gather(self.types.UInt, self._total, self.types.UInt(0))
        # leaf total / leaves, rounded down: the product has more bits than a word.
        first: Any = dr.mul_hi(leaf << self._shift, total)
        return [first + place for place in range(self.size)]


def unpacked(words: Sequence[Any]) -> tuple[Sequence[Any], list[Any], list[Any]]:
    """Return the words of coordinates, and per axis a node's corner and the size of its step, both in grid steps."""
    *coordinates, first, second = words
    Single: Any = dr.float32_array_t(type(second))
    corner = [_number(first, 0), _number(first, 16), _number(second, 0)]
    # A power of two is the exponent of a float.
    scale = [dr.reinterpret_array(Single, ((second >> (16 + 4 * axis) & 15) + 127) << 23) for axis in range(AXES)]
    return coordinates, corner, scale


def places(word: Any) -> list[Any]:
    """Return one coordinate of each of the four children, in steps of their node's own."""
    return [_number(word, 8 * child, 8) for child in range(CHILDREN)]
