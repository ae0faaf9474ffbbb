"""Which surfaces the eye may see from behind: Tachyon turns every normal towards the viewer."""

import numpy as np

from rayproof.cases.scene import Scene, Shape
from rayproof.reference.tachyon.surfaces import Ball, Facets, Level, Surface, surface_of


def from_behind(surface: Surface, eye: np.ndarray) -> np.ndarray:
    """Return whether the eye [m] is behind each facet, or the one surface; shape (facets,) or (1,)."""
    if isinstance(surface, Ball):
        return np.array([np.linalg.norm(eye - surface.center) < surface.radius])
    if isinstance(surface, Level):
        return np.array([surface.normal @ (eye - surface.point) <= 0])
    first = surface.corners[:, 0]
    normals = np.cross(surface.corners[:, 1] - first, surface.corners[:, 2] - first)
    return np.einsum("ij,ij->i", normals, eye - first) <= 0


def one_sided_from_behind(scene: Scene) -> str | None:
    """Return the first one-sided shape whose back the eye may see, in words, or None."""
    eye = np.asarray(scene.camera.eye, dtype=np.float64)
    for index, shape in enumerate(scene.shapes):
        if not shape.two_sided and _shows_its_back(shape, eye):
            return f"shapes[{index}]"
    return None


def _shows_its_back(shape: Shape, eye: np.ndarray) -> bool:
    surface = surface_of(shape)
    behind = from_behind(surface, eye)
    if not behind.any():
        return False
    # What is closed hides its back from an eye outside.
    return not (isinstance(surface, Facets) and _closed(surface) and abs(_winding(surface, eye)) < 0.5)


def _closed(facets: Facets) -> bool:
    """Return whether every directed edge has its reverse, as often."""
    start = facets.corners.reshape(-1, 3)
    end = np.roll(facets.corners, -1, axis=1).reshape(-1, 3)
    forth, back = (edges[np.lexsort(edges.T)] for edges in (np.hstack([start, end]), np.hstack([end, start])))
    return np.array_equal(forth, back)


def _winding(facets: Facets, eye: np.ndarray) -> float:
    """Return how often the facets wind around the eye, by their solid angles (Van Oosterom and Strackee, 1983)."""
    a, b, c = np.moveaxis(facets.corners - eye, 1, 0)
    x, y, z = (np.linalg.norm(side, axis=1) for side in (a, b, c))
    over = np.einsum("ij,ij->i", a, np.cross(b, c))
    dots = [np.einsum("ij,ij->i", left, right) for left, right in ((a, b), (b, c), (c, a))]
    under = x * y * z + dots[0] * z + dots[1] * x + dots[2] * y
    return float(np.arctan2(over, under).sum() / (2 * np.pi))
