"""What both variants answer along the rays through the pixel centres, ray by ray in row order."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from rayproof.cases.scene import Camera, Scene


@dataclass(frozen=True, kw_only=True)
class Interval:
    """The piece of a ray [m along its unit direction from the eye] on which a hit counts."""

    start: float
    end: float


@dataclass(frozen=True, kw_only=True)
class Hits:
    """The nearest hits, float64 whatever computed them; misses have shape -1, and zeros elsewhere."""

    direction: np.ndarray  # (n, 3), unit
    shape: np.ndarray  # (n,) index into the scene's shapes
    primitive: np.ndarray  # (n,) Mitsuba's index of the triangle
    position: np.ndarray  # (n, 3), m
    normal: np.ndarray  # (n, 3), unit, geometric, as the surface is oriented
    interactions: Any  # Mitsuba's own records, where feelers start


@dataclass(frozen=True, kw_only=True)
class Feelers:
    """What arrives from one light at the hits."""

    free: np.ndarray  # (n,) bool: nothing between hit and light; False where not asked
    arriving: np.ndarray  # (n, 3) W/m^2 on a surface that faces the light, were nothing in between


def own_interval(scene: Scene) -> Interval | None:
    """Return where to look along rays from the eye, or None where Mitsuba's sensor clips as the scene does."""
    if scene.clip == "depth":
        return None
    if scene.clip == "shell":
        return Interval(start=scene.camera.near, end=scene.camera.far)
    return Interval(start=0.0, end=float("inf"))


def pixel_centers(camera: Camera) -> np.ndarray:
    """Return the pixel centres on Mitsuba's film, (n, 2), each coordinate in (0, 1), row by row from the top left."""
    row, column = np.mgrid[0 : camera.lines, 0 : camera.width]
    row += camera.first_row
    centers = np.stack([(column + 0.5) / camera.width, (row + 0.5) / camera.height], axis=-1)
    return centers.reshape(-1, 2)
