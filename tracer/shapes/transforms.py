"""Where a shape stands: its model matrix, inverted on the host in float64 and rounded once to the working precision.

Coefficients that are 0 or 1 cost no operation, so that a translation or an axis-aligned scale is no more than that.
Where kernels are to be shared (`tracer.kernel.parameters`), only those that are 0 cost none. Where there are many
shapes, the matrix differs from lane to lane, and is looked up in memory instead of written into the kernel.
"""

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import drjit as dr
import numpy as np

from rayproof.cases.scene import IDENTITY, Matrix
from rayproof.tracer.kernel.parameters import LITERALS, KernelConstants


@dataclass(frozen=True, kw_only=True)
class Transform:
    """A model matrix and what it does to points, vectors and normals (Dr.Jit vectors) in both directions."""

    to_world: Matrix
    parameters: KernelConstants = field(default=LITERALS, repr=False, compare=False)
    name: str = ""  # of its numbers

    def _number(self, what: str, value: float, like: Any) -> Any:
        return self.parameters(f"{self.name} {what}", type(like)(float(value)))

    def _product(self, what: str, matrix: np.ndarray, vector: Any, *, transposed: bool = False) -> Any:
        """Return the product of a host matrix and a Dr.Jit vector, without its multiplications by 0 and 1."""

        def row(place: int) -> Any:
            total: Any = None
            for column, component in enumerate(vector):
                at = (column, place) if transposed else (place, column)
                value = matrix[at]
                if value == 0:
                    continue
                # A product with 1 is exact, and with it scenes share a kernel; one with 0 would turn -0 into 0.
                spared = value == 1 and not self.parameters.shared
                factor = None if spared else self._number(f"{what} {at}", value, component)
                if total is None:
                    total = component if factor is None else component * factor
                else:
                    total = total + component if factor is None else dr.fma(component, factor, total)
            return total

        return type(vector)(*(row(place) for place in range(3)))

    def _origin(self, like: Any, *, whole: bool = False) -> list[Any]:
        """Return the world position of the object-space origin, unless `whole` None where a coordinate is 0."""
        found = zip(self.translation, like, strict=True)
        return [
            None if t == 0 and not whole else self._number(f"translation {axis}", t, x)
            for axis, (t, x) in enumerate(found)
        ]

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
        # Subtracting first keeps the error proportional to the distance from the shape, not from the world's origin;
        # subtracting 0 changes nothing.
        pairs = zip(point, self._origin(point, whole=self.parameters.shared), strict=True)
        return self._product("inverse", self.inverse, type(point)(*(x if t is None else x - t for x, t in pairs)))

    def vector_to_object(self, vector: Any) -> Any:
        """Return a world direction in object space, not renormalised."""
        return self._product("inverse", self.inverse, vector)

    def point_to_world(self, point: Any) -> Any:
        """Return an object-space point in world space [m]."""
        pairs = zip(self._product("linear", self.linear, point), self._origin(point), strict=True)
        return type(point)(*(x if t is None else x + t for x, t in pairs))

    def vector_to_world(self, vector: Any) -> Any:
        """Return an object-space direction in world space, not renormalised."""
        return self._product("linear", self.linear, vector)

    def normal_to_world(self, normal: Any) -> Any:
        """Return the inverse transpose of the 3x3 part times an object-space normal, not renormalised."""
        return self._product("inverse", self.inverse, normal, transposed=True)


def _product(rows: Any, vector: Any) -> Any:
    return type(vector)(*(dr.dot(row, vector) for row in rows))


@dataclass(frozen=True, kw_only=True)
class GatheredTransform:
    """What `Transform` does to points, vectors and normals, by numbers that were gathered."""

    rows: Any  # of the inverse of the 3x3 part
    translation: Any  # m
    columns: Any = None  # of the 3x3 part itself, where somebody needs it
    identity: bool = False

    def point_to_object(self, point: Any) -> Any:
        """Return a world point in object space."""
        return _product(self.rows, point - self.translation)

    def vector_to_object(self, vector: Any) -> Any:
        """Return a world direction in object space, not renormalised."""
        return _product(self.rows, vector)

    def vector_to_world(self, vector: Any) -> Any:
        """Return an object-space direction in world space, not renormalised."""
        x, y, z = self.columns
        return dr.fma(x, vector.x, dr.fma(y, vector.y, z * vector.z))

    def point_to_world(self, point: Any) -> Any:
        """Return an object-space point in world space [m]."""
        return self.vector_to_world(point) + self.translation

    def normal_to_world(self, normal: Any) -> Any:
        """Return the inverse transpose of the 3x3 part times an object-space normal, not renormalised."""
        x, y, z = self.rows
        return dr.fma(x, normal.x, dr.fma(y, normal.y, z * normal.z))
