"""The pinhole camera as an orthonormal frame: image points become directions that are linear in the image.

Source: the specification, "Conventions" and CAM-3; the frame itself is Gram-Schmidt.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from rayproof.cases.scene import Camera


@dataclass(frozen=True, kw_only=True)
class View:
    """A camera's frame, and the direction D(px, py) = corner + px across + py down, whose depth along F is 1."""

    eye: np.ndarray  # (3,) m
    forward: np.ndarray  # (3,)
    right: np.ndarray  # (3,)
    up: np.ndarray  # (3,)
    across: np.ndarray  # (3,) change of D per pixel to the right
    down: np.ndarray  # (3,) change of D per pixel downwards
    corner: np.ndarray  # (3,) D at the top-left corner of the image

    def directions(self, points: np.ndarray) -> np.ndarray:
        """Return D, of depth 1 and so not of unit length, at image points (N, 2) [px]; shape (N, 3)."""
        return self.corner + points[:, :1] * self.across + points[:, 1:] * self.down


@lru_cache(maxsize=64)
def view_of(camera: Camera) -> View:
    """Return the camera's frame: F towards the target, R = F x up, U = R x F."""
    forward = _unit(np.subtract(camera.target, camera.eye, dtype=np.float64))
    right = _unit(np.cross(forward, _unit(np.asarray(camera.up, dtype=np.float64))))
    up = np.cross(right, forward)
    tangent = np.tan(camera.alpha)
    return View(
        eye=np.asarray(camera.eye, dtype=np.float64),
        forward=forward,
        right=right,
        up=up,
        across=right * (2 * tangent * camera.aspect / camera.width),
        down=up * (-2 * tangent / camera.height),
        corner=forward - right * (tangent * camera.aspect) + up * tangent,
    )


def pixel_centers(camera: Camera) -> np.ndarray:
    """Return the image points [px] of all pixel centres that are drawn, row by row, shape (lines * width, 2)."""
    rows, columns = np.mgrid[: camera.lines, : camera.width]
    return np.stack([columns.ravel() + 0.5, rows.ravel() + (camera.first_row + 0.5)], axis=1)


def _unit(vector: np.ndarray) -> np.ndarray:
    # Scaled first, so that squaring neither overflows nor underflows.
    scaled = vector / np.abs(vector).max()
    return scaled / np.linalg.norm(scaled)
