"""The unit square, and with an oblique matrix parallelograms: by numbers, cubes without height."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from rayproof.tracer.kernel.arrays import ArrayTypes
from rayproof.tracer.shapes.cube import CORNERS, TracedCube
from rayproof.tracer.shapes.shape import HALF


@dataclass(frozen=True, kw_only=True)
class SquareArrays:
    """A square, by its half-size in object space and by its vectors in world space."""

    center: Any  # m
    half_width: Any  # m
    half_height: Any  # m
    orthogonal: bool
    half: float = HALF


@dataclass(frozen=True)
class TracedSquare(TracedCube):
    """A square [-HALF, HALF]^2 in z = 0 of object space."""

    slot, solid = "square", False
    corners = CORNERS * (1, 1, 0)

    @cached_property
    def vectors(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return its centre, half-width and half-height in world space [m]."""
        linear = self.transform.linear
        return self.transform.translation, linear[:, 0] * HALF, linear[:, 1] * HALF

    @cached_property
    def orthogonal(self) -> bool:
        """Return whether its sides are at right angles: where they are not, the formula by vectors is another one."""
        _, width, height = self.vectors
        # Rounding leaves a rotation's columns this far from orthogonal; solving for that would be solving for noise.
        noise = 4 * np.finfo(np.float64).eps * np.linalg.norm(width) * np.linalg.norm(height)
        return bool(abs(width @ height) <= noise)

    @property
    def tree(self) -> str:
        """Return which of the trees it goes into."""
        return "square" if self.orthogonal else "sheared square"

    def _arrays(self, vectors: Any) -> SquareArrays:
        center, width, height = vectors
        return SquareArrays(center=center, half_width=width, half_height=height, orthogonal=self.orthogonal)

    def arrays(self, types: ArrayTypes) -> SquareArrays:
        """Return its vectors as literals."""
        return self._arrays(types.Vector(*map(float, vector)) for vector in self.vectors)

    def own_numbers(self) -> np.ndarray:
        """Return its vectors, and three zeros."""
        return np.concatenate([*self.vectors, np.zeros(3)])

    def unpacked(self, numbers: Any, types: ArrayTypes) -> SquareArrays:
        """Return the vectors of a square whose sides are at right angles if this one's are."""
        return self._arrays(types.Vector(*numbers[3 * k : 3 * k + 3]) for k in range(3))
