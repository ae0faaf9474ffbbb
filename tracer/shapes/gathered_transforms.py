"""A model matrix that differs from lane to lane, looked up in memory instead of written into the kernel."""

from dataclasses import dataclass
from typing import Any

import drjit as dr


def _product(rows: Any, vector: Any) -> Any:
    return type(vector)(*(dr.dot(row, vector) for row in rows))


@dataclass(frozen=True, kw_only=True)
class GatheredTransform:
    """What `tracer.shapes.transforms.Transform` does to points, vectors and normals, by numbers that were gathered."""

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
