"""The classes `Ray`, `Interval`, `Hit`, `NearestHit` and `ShadowRay`."""

from dataclasses import dataclass, field
from typing import Any

import drjit as dr


@dataclass(frozen=True, kw_only=True)
class Ray:
    """Points origin + t direction, as Dr.Jit arrays [m]. Only camera rays have a unit direction."""

    origin: Any
    direction: Any
    # The part of triangle formulas that depends only on the ray, computed once for all triangles: a
    # `tracer.kernel.arithmetic.Shear`, or None if each formula computes it.
    shear: Any = field(default=None, repr=False, compare=False)

    def at(self, t: Any) -> Any:
        """Return the points at parameter `t` [m]."""
        return dr.fma(self.direction, t, self.origin)


@dataclass(frozen=True, kw_only=True)
class Interval:
    """The open interval of t in which an intersection counts."""

    nearest: Any
    farthest: Any

    def contains(self, t: Any) -> Any:
        """Return the mask of `t` inside the interval. NaN and infinities never are."""
        return (t > self.nearest) & (t < self.farthest)

    def smallest(self, near: Any, far: Any) -> Any:
        """Return the smaller of two ordered roots that is inside, or inf."""
        t = dr.select(near > self.nearest, near, far)
        return dr.select(self.contains(t), t, dr.inf)


@dataclass(frozen=True, kw_only=True)
class NearestHit:
    """The nearest hit per ray: t [m] or inf, shape and face index or -1, and the triangle's number in the tree."""

    distance: Any
    shape: Any
    face: Any
    number: Any  # None without triangles in a tree


@dataclass(frozen=True, kw_only=True)
class Hit:
    """A hit point from which a shadow ray starts."""

    position: Any  # m
    normal: Any  # the side that the light must be on
    shape: Any  # index
    clearance: Any  # m, bound on the distance from the surface along the normal
    ray: Ray  # the ray that hit the point
    distance: Any  # m, along it


@dataclass(frozen=True, kw_only=True)
class Start:
    """The start of a shadow ray; t = 1 is the light."""

    origin: Any  # m
    nearest: Any = 0.0  # hits at smaller t are ignored
    skip: Any = None  # index of the shape that is left out, or None
    shorter: float = 0.0  # share of the distance, at the light's end, that is not tested


@dataclass(frozen=True, kw_only=True)
class ShadowRay:
    """A shadow ray: t in the interval is tested, the shape `skip` (or None) is left out."""

    ray: Ray
    interval: Interval
    skip: Any
    active: Any  # mask of the lanes that need its result

    @property
    def arrays(self) -> tuple[Any, ...]:
        """Return its arrays."""
        ray, interval = self.ray, self.interval
        return ray.origin, ray.direction, interval.nearest, interval.farthest, self.skip, self.active
