"""The unit cube."""

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from rayproof.tracer.kernel.arrays import ArrayTypes
from rayproof.tracer.shapes.shape import HALF, TracedShape

CORNERS = np.array([[x, y, z] for x in (-HALF, HALF) for y in (-HALF, HALF) for z in (-HALF, HALF)])


@dataclass(frozen=True, kw_only=True)
class CubeArrays:
    """The unit cube of object space."""

    half: float = HALF


@dataclass(frozen=True)
class TracedCube(TracedShape):
    """A cube [-HALF, HALF]^3 of object space."""

    slot, solid = "cube", True
    corners: ClassVar[np.ndarray] = CORNERS  # in object space [m]

    def arrays(self, types: ArrayTypes) -> Any:
        """Return the unit cube."""
        return CubeArrays()

    @staticmethod
    def normal(some: Any, point: Any) -> Any:
        """Return object-space normals at `point` [m], or where the ray met it (`tracer.stages.hit_attributes`)."""
        formula = some.world.configuration.formula("cube_normal")
        if formula.facts.get("takes") == "ray":
            return formula.function(some.object_ray(), some.hit.distance)
        return formula.function(point)

    @property
    def ball(self) -> tuple[np.ndarray, float]:
        """Return the middle and the distance to the farthest corner [m]."""
        corners = self.corners @ self.transform.linear.T
        return self.transform.translation, float(np.linalg.norm(corners, axis=1).max())

    def center_and_half(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the middle and half the size [m] of the box about it."""
        sides = self.transform.linear[:, self.corners.any(axis=0)]
        return self.transform.translation, np.abs(sides).sum(axis=1) * HALF
