"""Spheres, and with an uneven matrix ellipsoids."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from rayproof.cases.scene import Vector
from rayproof.tracer.kernel.arrays import ArrayTypes
from rayproof.tracer.shapes.shape import TracedShape


@dataclass(frozen=True, kw_only=True)
class SphereArrays:
    """A sphere in object space."""

    center: Any  # m
    radius: Any  # m


@dataclass(frozen=True)
class TracedSphere(TracedShape):
    """A sphere."""

    slot, solid = "sphere", True

    @property
    def center(self) -> Vector:
        """Return its centre in object space [m]."""
        return self.shape.center

    @property
    def radius(self) -> float:
        """Return its radius in object space [m]."""
        return self.shape.radius

    def arrays(self, types: ArrayTypes) -> SphereArrays:
        """Return centre and radius as literals."""
        return SphereArrays(center=types.Vector(*self.center), radius=types.Float(self.radius))

    @staticmethod
    def normal(some: Any, point: Any) -> Any:
        """Return object-space normals at `point` [m] (`tracer.stages.hit_attributes`)."""
        center = some.constant("center", lambda one: one.center, lambda xyz: some.world.types.Vector(*xyz))
        return some.world.configuration["sphere_normal"](point, center)

    @property
    def _world_center(self) -> np.ndarray:
        return self.transform.linear @ np.asarray(self.center) + self.transform.translation

    @property
    def ball(self) -> tuple[np.ndarray, float]:
        """Return the centre and the largest half-axis [m]."""
        return self._world_center, float(np.linalg.norm(self.transform.linear, 2) * self.radius)

    def center_and_half(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the middle and half the size [m] of the box about it."""
        return self._world_center, np.linalg.norm(self.transform.linear, axis=1) * self.radius

    def own_numbers(self) -> np.ndarray:
        """Return centre and radius."""
        return np.array([*self.center, self.radius])

    def unpacked(self, numbers: Any, types: ArrayTypes) -> SphereArrays:
        """Return centre and radius."""
        return SphereArrays(center=types.Vector(*numbers[:3]), radius=numbers[3])

    def spreads(self) -> np.ndarray:
        """Return norm(abs(A^-1)) norm(A) of its matrix A."""
        if self.transform.identity:
            return np.ones(1)
        linear, inverse = self.transform.linear, self.transform.inverse
        return np.array([np.linalg.norm(abs(inverse), 2) * np.linalg.norm(linear, 2)])

    def extent(self) -> float:
        """Return a bound on distance from the world's origin plus size [m]."""
        return self._placed_extent(math.hypot(*self.center) + self.radius)
