"""Spheres, cubes, squares and planes as traced: their arrays, intersections and normals.

With an uneven matrix a sphere is an ellipsoid. With an oblique matrix a square is a parallelogram; by numbers it is a
cube without height.
"""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from rayproof.cases.scene import Cube, Mesh, Plane, Shape, Sphere, Square, Triangle, Vector
from rayproof.tracer.kernel.arrays import ArrayTypes
from rayproof.tracer.shapes.meshes import TracedMesh, TracedTriangle
from rayproof.tracer.shapes.shape import HALF, TracedShape


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
    def normal(shapes: Any, point: Any) -> Any:
        """Return object-space normals at `point` [m] (`tracer.light_path.surfaces`)."""
        center = shapes.constant("center", lambda one: one.center, lambda xyz: shapes.world.types.Vector(*xyz))
        return shapes.world.configuration["sphere_normal"](point, center)

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

    def reaches(self) -> np.ndarray:
        """Return a bound on distance from the world's origin plus size [m]."""
        return self._placed_reaches(math.hypot(*self.center) + self.radius)


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
    def normal(shapes: Any, point: Any) -> Any:
        """Return object-space normals at `point` [m], or where the ray met it (`tracer.light_path.surfaces`)."""
        formula = shapes.world.configuration.formula("cube_normal")
        if formula.facts.get("takes") == "ray":
            return formula.function(shapes.object_ray(), shapes.hit.distance)
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
        """Return the name of its tree."""
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
        """Return the square's vectors; its sides are marked as orthogonal if those of this square are."""
        return self._arrays(types.Vector(*numbers[3 * k : 3 * k + 3]) for k in range(3))


@dataclass(frozen=True, kw_only=True)
class PlaneArrays:
    """The plane z = 0 of object space."""


@dataclass(frozen=True)
class TracedPlane(TracedShape):
    """The plane z = 0 of object space."""

    slot, endless = "plane", True

    def arrays(self, types: ArrayTypes) -> PlaneArrays:
        """Return the plane."""
        return PlaneArrays()


KINDS: dict[type[Shape], type[TracedShape]] = {
    Sphere: TracedSphere,
    Cube: TracedCube,
    Plane: TracedPlane,
    Square: TracedSquare,
    Triangle: TracedTriangle,
    Mesh: TracedMesh,
}


def traced(shape: Shape) -> TracedShape:
    """Return the tracer's representation of a shape.

    Raises:
        LookupError: the tracer has no formula for this kind; the message lists the known kinds.

    """
    if type(shape) not in KINDS:
        names = ", ".join(kind.__name__ for kind in KINDS)
        raise LookupError(f"no formula intersects a {type(shape).__name__}; known: {names}")
    return KINDS[type(shape)](shape)
