"""Which samples of an image each SIMD lane computes: one, or a tile of several that go through the tree together.

Neighbouring lanes hold neighbouring tiles, in blocks of four by four, so that what a processor does at once stays
close together in the image as well.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import drjit as dr
import numpy as np

BLOCK = 4  # tiles, per side


@dataclass(frozen=True, kw_only=True)
class Lanes:
    """An image of width x height samples, cut into tiles of `columns` x `rows`, one per lane."""

    width: int
    height: int
    columns: int = 1
    rows: int = 1

    @property
    def tile(self) -> int:
        """Return the samples per lane."""
        return self.columns * self.rows

    @cached_property
    def _blocks(self) -> tuple[int, int]:
        across, down = self.columns * BLOCK, self.rows * BLOCK
        return -(-self.width // across), -(-self.height // down)

    @property
    def count(self) -> int:
        """Return the number of lanes; tiles that reach over the border repeat its samples."""
        return self.width * self.height if self.tile == 1 else self._blocks[0] * self._blocks[1] * BLOCK * BLOCK

    def positions(self, UInt: Any) -> list[tuple[Any, Any]]:
        """Return (column, row) of each of a lane's samples."""
        index = dr.arange(UInt, self.count)
        if self.tile == 1:
            row = index // self.width
            return [(index - row * self.width, row)]
        block, place = index // (BLOCK * BLOCK), index % (BLOCK * BLOCK)
        down = block // self._blocks[0]
        left = ((block - down * self._blocks[0]) * BLOCK + place % BLOCK) * self.columns
        top = (down * BLOCK + place // BLOCK) * self.rows
        columns = self._within(left, self.width, self.columns)
        rows = self._within(top, self.height, self.rows)
        return [(column, row) for row in rows for column in columns]

    @staticmethod
    def _within(first: Any, size: int, count: int) -> list[Any]:
        """Return a tile's coordinates along one axis; what lies outside is moved to the border."""
        if size % (count * BLOCK) == 0:
            return [first + k for k in range(count)]
        if size % count == 0:
            # Tiles lie inside or outside as a whole, and stay whole: neighbours are written together.
            first = dr.minimum(first, size - count)
            return [first + k for k in range(count)]
        return [dr.minimum(first + k, size - 1) for k in range(count)]

    def numbers(self, positions: list[tuple[Any, Any]]) -> list[Any]:
        """Return each sample's number in the image, row by row."""
        return [row * self.width + column for column, row in positions]

    def image(self, values: list[np.ndarray]) -> np.ndarray:
        """Return (height, width) from each of the lane's samples, (lanes,); a literal fills its samples."""
        if self.tile == 1:
            return np.broadcast_to(values[0], (self.count,)).reshape(self.height, self.width)
        across, down = self._blocks
        full = np.stack([np.broadcast_to(value, (self.count,)) for value in values])
        blocks = full.reshape(self.rows, self.columns, down, across, BLOCK, BLOCK)
        # (row in tile, column in tile, block row, block column, tile row, tile column)
        return blocks.transpose(2, 4, 0, 3, 5, 1).reshape(down * BLOCK * self.rows, -1)[: self.height, : self.width]
