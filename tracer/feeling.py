"""What a strategy against shadow acne receives and returns."""

from dataclasses import dataclass
from typing import Any

from rayproof.tracer.rays import Interval, Ray


@dataclass(frozen=True, kw_only=True)
class Hit:
    """A hit point as a light feeler sees it."""

    position: Any  # m
    normal: Any  # the side that the light must be on
    shape: Any  # index
    clearance: Any  # m, bound on the distance from the surface along the normal
    ray: Ray  # the one that found the point
    distance: Any  # m, along it


@dataclass(frozen=True, kw_only=True)
class Start:
    """Where a feeler begins; t = 1 is the light."""

    origin: Any  # m
    nearest: Any = 0.0  # t below which nothing counts
    skip: Any = None  # index of the shape that is left out, or None
    shorter: float = 0.0  # share of the way, at the light's end, that is not tested either


@dataclass(frozen=True, kw_only=True)
class Feeler:
    """A light feeler: t in the interval is tested, the shape `skip` (or None) is left out."""

    ray: Ray
    interval: Interval
    skip: Any
    active: Any  # where it is asked for

    @property
    def arrays(self) -> tuple[Any, ...]:
        """Return all that it is made of."""
        ray, interval = self.ray, self.interval
        return ray.origin, ray.direction, interval.nearest, interval.farthest, self.skip, self.active
