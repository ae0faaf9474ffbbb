"""What a shape is to the tracer: here what all kinds have in common, in a file for each kind the rest."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from rayproof.cases.scene import Vector
from rayproof.tracer.kernel.arrays import ArrayTypes
from rayproof.tracer.shapes.transforms import Transform

HALF = 0.5  # m, half the size of the unit cube and the unit square


@dataclass(frozen=True)
class TracedShape:
    """A shape of a scene and what the tracer needs to know of it on the host, in float64."""

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
        """Return what its intersection formula is given beside the ray, as literals."""
        raise TypeError(f"{type(self).__name__} is intersected triangle by triangle")

    @property
    def can_shadow_itself(self) -> bool:
        """Return whether it may stand between a point of its own and a light above that point's horizon.

        A convex body with its normal outward cannot, and neither can a flat one; a two-sided body is lit from inside.
        """
        return self.solid and self.shape.two_sided

    @property
    def tree(self) -> str:
        """Return which of the trees it goes into where there are many of its kind."""
        return self.slot

    @property
    def ball(self) -> tuple[np.ndarray, float] | None:
        """Return the centre and the radius [m] of a ball about it; None where it has no end, or is many."""
        return None

    def center_and_half(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the middle and half the size [m] of the box about it, where it may go into a tree of its kind."""
        raise TypeError(f"{type(self).__name__} goes into no tree of its kind")

    @property
    def box(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the lower and upper corner of the box about it [m]."""
        center, half = self.center_and_half()
        # The box's own roundings, and those of what it is computed from.
        half = half + (np.abs(center) + half) * 2.0**-48
        return center - half, center + half

    def own_numbers(self) -> np.ndarray:
        """Return what a tree keeps of it beside its matrix, a multiple of four numbers."""
        return np.zeros(0)

    def packed(self, *, identity: bool) -> np.ndarray:
        """Return what a tree keeps of it: inverse and translation, unless `identity`, and its own numbers."""
        placed = [] if identity else [self.transform.inverse.reshape(-1), self.transform.translation]
        numbers = np.concatenate([*placed, self.own_numbers()])
        return numbers if len(numbers) else np.zeros(4)

    def unpacked(self, numbers: Any, types: ArrayTypes) -> Any:
        """Return what the intersection formula of a shape of its kind is given, by own numbers on the device."""
        return self.arrays(types)

    @property
    def magnified(self) -> float:
        """Return how much more a point is off that was taken to object space; 1 without stretches across its axes."""
        return float((np.abs(self.transform.linear) @ np.abs(self.transform.inverse)).sum(axis=1).max())

    def spreads(self) -> np.ndarray:
        """Return what multiplies the rounding errors of each of its faces, at least 1, (faces,)."""
        return np.ones(1)

    def extent(self) -> float:
        """Return a bound on distance from the world's origin plus size [m]; of a plane, of its own origin only."""
        return self._placed_extent(1.0)

    def _placed_extent(self, local: float) -> float:
        if self.transform.identity:
            return local
        return float(np.linalg.norm(self.transform.translation) + np.linalg.norm(self.transform.linear, 2) * local)
