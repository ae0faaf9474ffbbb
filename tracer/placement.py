"""Where a shape stands: its model matrix, inverted on the host in float64 and rounded once to the working precision.

Coefficients that are 0 or 1 cost no operation, so that a translation or an axis-aligned scale is no more than that.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import drjit as dr
import numpy as np

from cases.scene import IDENTITY, Matrix


def _row(coefficients: np.ndarray, vector: Any) -> Any:
    """Return the dot product of host coefficients and a Dr.Jit vector, without its multiplications by 0 and 1."""
    terms = [(float(c), component) for c, component in zip(coefficients, vector, strict=True) if c != 0]
    total: Any = None
    for coefficient, component in terms:
        if total is None:
            total = component if coefficient == 1 else component * coefficient
        else:
            total = total + component if coefficient == 1 else dr.fma(component, coefficient, total)
    return total


def _product(matrix: np.ndarray, vector: Any) -> Any:
    return type(vector)(*(_row(row, vector) for row in matrix))


@dataclass(frozen=True, kw_only=True)
class Placement:
    """A model matrix and what it does to points, vectors and normals (Dr.Jit vectors) in both directions."""

    to_world: Matrix

    @property
    def identity(self) -> bool:
        """Return whether object space is world space, so that nothing needs to be computed."""
        return self.to_world == IDENTITY

    @cached_property
    def linear(self) -> np.ndarray:
        """Return the 3x3 part, float64."""
        return np.asarray(self.to_world, dtype=np.float64)[:3, :3]

    @cached_property
    def inverse(self) -> np.ndarray:
        """Return the inverse of the 3x3 part, float64."""
        return np.linalg.inv(self.linear)

    @cached_property
    def translation(self) -> np.ndarray:
        """Return the world position of the object-space origin [m], float64."""
        return np.asarray(self.to_world, dtype=np.float64)[:3, 3]

    def point_to_object(self, point: Any) -> Any:
        """Return a world point in object space."""
        # Subtracting first keeps the error proportional to the distance from the shape, not from the world's origin.
        moved = type(point)(*(x if t == 0 else x - float(t) for x, t in zip(point, self.translation, strict=True)))
        return _product(self.inverse, moved)

    def vector_to_object(self, vector: Any) -> Any:
        """Return a world direction in object space, not renormalised."""
        return _product(self.inverse, vector)

    def point_to_world(self, point: Any) -> Any:
        """Return an object-space point in world space [m]."""
        moved = _product(self.linear, point)
        return type(point)(*(x if t == 0 else x + float(t) for x, t in zip(moved, self.translation, strict=True)))

    def vector_to_world(self, vector: Any) -> Any:
        """Return an object-space direction in world space, not renormalised."""
        return _product(self.linear, vector)

    def normal_to_world(self, normal: Any) -> Any:
        """Return the inverse transpose of the 3x3 part times an object-space normal, not renormalised."""
        return _product(self.inverse.T, normal)
