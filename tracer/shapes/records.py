"""Shapes on the device: what an intersection formula is given beside the ray."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from rayproof.cases.baking import world_triangles
from rayproof.cases.scene import Cube, Plane, Shape, Sphere, Square, Triangle
from rayproof.tracer.device.arrays import ArrayTypes
from rayproof.tracer.shapes.transforms import Transform

HALF = 0.5  # m, half the size of the unit cube and the unit square

SLOTS: dict[type[Shape], str] = {
    Sphere: "sphere",
    Cube: "cube",
    Plane: "plane",
    Square: "square",
    Triangle: "triangle",
}


@dataclass(frozen=True, kw_only=True)
class SphereArrays:
    """A sphere in object space."""

    center: Any  # m
    radius: Any  # m


@dataclass(frozen=True, kw_only=True)
class CubeArrays:
    """The unit cube of object space."""

    half: float = HALF


@dataclass(frozen=True, kw_only=True)
class PlaneArrays:
    """The plane z = 0 of object space."""


@dataclass(frozen=True, kw_only=True)
class SquareArrays:
    """A square, by its half-size in object space and by its vectors in world space."""

    center: Any  # m
    half_width: Any  # m
    half_height: Any  # m
    orthogonal: bool
    half: float = HALF


@dataclass(frozen=True, kw_only=True)
class TriangleArrays:
    """A triangle by its corners in world space."""

    first: Any  # m
    second: Any  # m
    third: Any  # m


def square_vectors(transform: Transform) -> tuple[np.ndarray, np.ndarray, np.ndarray, bool]:
    """Return a square's centre, half-width and half-height [m], float64, and whether the two are orthogonal."""
    width, height = transform.linear[:, 0] * HALF, transform.linear[:, 1] * HALF
    # Rounding leaves a rotation's columns this far from orthogonal; solving for that would be solving for noise.
    noise = 4 * np.finfo(np.float64).eps * np.linalg.norm(width) * np.linalg.norm(height)
    return transform.translation, width, height, bool(abs(width @ height) <= noise)


def _square(transform: Transform, types: ArrayTypes) -> SquareArrays:
    *vectors, orthogonal = square_vectors(transform)
    center, width, height = (types.Vector(*map(float, vector)) for vector in vectors)
    return SquareArrays(center=center, half_width=width, half_height=height, orthogonal=orthogonal)


def upload(shape: Shape, types: ArrayTypes) -> Any:
    """Return the device record of a shape, as literals.

    Raises:
        LookupError: the tracer has no formula for such a shape; lists those that it has.

    """
    match shape:
        case Sphere():
            return SphereArrays(center=types.Vector(*shape.center), radius=types.Float(shape.radius))
        case Cube():
            return CubeArrays()
        case Plane():
            return PlaneArrays()
        case Square():
            return _square(Transform(to_world=shape.to_world), types)
        case Triangle():
            first, second, third = (types.Vector(*map(float, corner)) for corner in world_triangles(shape)[0])
            return TriangleArrays(first=first, second=second, third=third)
        case _:
            known = ", ".join(kind.__name__ for kind in SLOTS)
            raise LookupError(f"no formula intersects a {type(shape).__name__}; known: {known} and Mesh")
