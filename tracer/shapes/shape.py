"""`TracedShape`, the base of all kinds of shapes, and `Transform`, a model matrix and its inverse on the device.

The model matrix is inverted on the host in float64 and rounded once to the working precision.

Coefficients of 0 or 1 cost no operation, so that a translation costs three additions and an axis-aligned scale three
products. In shared kernels (`tracer.kernel.parameters`) only coefficients of 0 cost none. With many shapes the matrix
differs between lanes and is read from memory instead of being a literal of the kernel.
"""

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, ClassVar

import drjit as dr
import numpy as np

from rayproof.cases.scene import IDENTITY, Matrix, Vector
from rayproof.tracer.kernel.arrays import ArrayTypes
from rayproof.tracer.kernel.parameters import LITERALS, KernelConstants

HALF = 0.5  # m, half the size of the unit cube and the unit square


@dataclass(frozen=True, kw_only=True)
class Transform:
    """A model matrix, and the transforms of points, vectors and normals (Dr.Jit vectors) in both directions."""

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
        """Return the world position of the object-space origin; unless `whole`, None for each coordinate that is 0."""
        coordinates = zip(self.translation, like, strict=True)
        return [
            None if t == 0 and not whole else self._number(f"translation {axis}", t, x)
            for axis, (t, x) in enumerate(coordinates)
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
    """The transforms of points, vectors and normals of `Transform`, with numbers that were gathered from memory."""

    rows: Any  # of the inverse of the 3x3 part
    translation: Any  # m
    columns: Any = None  # of the 3x3 part itself, if a formula needs it
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


@dataclass(frozen=True)
class TracedShape:
    """A shape of a scene, with its numbers for the tracer on the host, in float64."""

    shape: Any  # `rayproof.cases.scene.Shape`

    slot: ClassVar[str]  # of the formula that intersects a ray with it, or with each of its triangles
    endless: ClassVar[bool] = False
    single: ClassVar[bool] = True  # whether it is one primitive, which may be unrolled; a mesh is many
    solid: ClassVar[bool] = False  # whether it is closed and convex: two-sided, it is lit and seen from inside
    own_normal: ClassVar[bool] = False  # whether it has a normal of its own instead of its kind's

    @cached_property
    def transform(self) -> Transform:
        """Return its model matrix."""
        return Transform(to_world=self.shape.to_world)

    @property
    def empty(self) -> bool:
        """Return whether no ray can meet it."""
        return False

    @property
    def flat_normal(self) -> Vector:
        """Return the object-space normal of a flat shape; of others nothing that counts."""
        return (0.0, 0.0, 1.0)

    @property
    def center(self) -> Vector:
        """Return a sphere's centre in object space [m]; of others nothing that counts."""
        return (0.0, 0.0, 0.0)

    @property
    def radius(self) -> float:
        """Return a sphere's radius in object space [m]; of others nothing that counts."""
        return 1.0

    def arrays(self, types: ArrayTypes) -> Any:
        """Return the shape argument of its intersection formula, as literals."""
        raise TypeError(f"{type(self).__name__} is intersected triangle by triangle")

    @property
    def can_shadow_itself(self) -> bool:
        """Return whether it may block the segment from one of its points to a light above that point's horizon.

        A convex body with outward normals cannot, and neither can a flat one; a two-sided body is also lit from inside.
        """
        return self.solid and self.shape.two_sided

    @property
    def tree(self) -> str:
        """Return the name of its tree, used if there are many shapes of its kind."""
        return self.slot

    @property
    def ball(self) -> tuple[np.ndarray, float] | None:
        """Return the centre and the radius [m] of a ball about it; None if it is infinite, or a mesh."""
        return None

    def center_and_half(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the middle and half the size [m] of its bounding box, for kinds that may be put into a tree."""
        raise TypeError(f"{type(self).__name__} goes into no tree of its kind")

    @property
    def box(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the lower and upper corner of the box about it [m]."""
        center, half = self.center_and_half()
        # The rounding errors of the box and of its inputs.
        half = half + (np.abs(center) + half) * 2.0**-48
        return center - half, center + half

    def own_numbers(self) -> np.ndarray:
        """Return its numbers in a tree in addition to its matrix, a multiple of four numbers."""
        return np.zeros(0)

    def packed(self, *, identity: bool) -> np.ndarray:
        """Return its numbers in a tree: inverse matrix and translation (not if `identity`), then its own numbers."""
        placed = [] if identity else [self.transform.inverse.reshape(-1), self.transform.translation]
        numbers = np.concatenate([*placed, self.own_numbers()])
        return numbers if len(numbers) else np.zeros(4)

    def unpacked(self, numbers: Any, types: ArrayTypes) -> Any:
        """Return the shape argument of the intersection formula for this kind, from its numbers on the device."""
        return self.arrays(types)

    @property
    def magnified(self) -> float:
        """Return the factor of a point's error due to its way to object space; 1 without stretches across its axes."""
        return float((np.abs(self.transform.linear) @ np.abs(self.transform.inverse)).sum(axis=1).max())

    def spreads(self) -> np.ndarray:
        """Return the factor of the rounding errors of each of its faces, at least 1, (faces,)."""
        return np.ones(1)

    def reaches(self) -> np.ndarray:
        """Return (faces,) bounds on distance from the world's origin plus size [m]; of a plane, of its own origin."""
        return self._placed_reaches(1.0)

    def _placed_reaches(self, local: float) -> np.ndarray:
        placed = np.linalg.norm(self.transform.translation) + np.linalg.norm(self.transform.linear, 2) * local
        return np.array([local if self.transform.identity else placed])
