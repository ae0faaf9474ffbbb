"""What a strategy against shadow acne receives and returns."""

from dataclasses import dataclass
from typing import Any

from tracer.rays import Ray


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
