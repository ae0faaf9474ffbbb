"""The pinhole camera as an orthonormal frame: view directions, matrices and frustum corners.

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

    def image_points(self, positions: np.ndarray) -> np.ndarray:
        """Return the image points (N, 2) [px] at which world points (N, 3) [m] are seen; NaN behind the eye."""
        offset = positions - self.eye
        depth = offset @ self.forward
        with np.errstate(all="ignore"):
            projected = offset / np.where(depth > 0, depth, np.nan)[:, np.newaxis] - self.corner
        return np.stack([projected @ axis / (axis @ axis) for axis in (self.across, self.down)], axis=1)


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
    rows, columns = np.mgrid[: camera.height, : camera.width]
    return np.stack([columns.ravel() + 0.5, rows.ravel() + 0.5], axis=1)


def _unit(vector: np.ndarray) -> np.ndarray:
    # Scaled first, so that squaring neither overflows nor underflows.
    scaled = vector / np.abs(vector).max()
    return scaled / np.linalg.norm(scaled)


# The camera stage in closed form: matrices and inverses, frustum corners, pixel <-> NDC (CAM-1, CAM-2, CAM-3).


def camera_answer(camera: Camera) -> dict[str, np.ndarray]:
    """Return the dictionary of `cases.stages` for `Stage.CAMERA`."""
    view = view_of(camera)
    to_camera, to_world = _view_matrices(view)
    to_clip, from_clip = _projection_matrices(camera)
    size = np.array([camera.width, camera.height])
    centers = pixel_centers(camera).reshape(camera.height, camera.width, 2)
    ndc = (2 * centers - size) / size * (1, -1)
    return {
        "view": to_camera,
        "view_inverse": to_world,
        "projection": to_clip,
        "projection_inverse": from_clip,
        "frustum_corners": _frustum_corners(camera, view),
        "ndc": ndc,
        "pixel": (ndc * (1, -1) + 1) * size / 2,
    }


def _view_matrices(view: View) -> tuple[np.ndarray, np.ndarray]:
    """Return world -> camera and camera -> world; the axes are orthonormal, so the inverse is the transpose."""
    axes = np.stack([view.right, view.up, view.forward])
    to_camera, to_world = np.eye(4), np.eye(4)
    to_camera[:3, :3], to_camera[:3, 3] = axes, -axes @ view.eye
    to_world[:3, :3], to_world[:3, 3] = axes.T, view.eye
    return to_camera, to_world


def _projection_matrices(camera: Camera) -> tuple[np.ndarray, np.ndarray]:
    """Return camera -> clip and back: clip depth (z - near) far / (far - near), over w = z, runs from 0 to 1."""
    tangent = np.tan(camera.alpha)
    half_width, half_height = tangent * camera.aspect, tangent
    near, far = camera.near, camera.far
    slope = 1 / (1 - near / far)
    to_clip, from_clip = np.zeros((4, 4)), np.zeros((4, 4))
    to_clip[0, 0], to_clip[1, 1], to_clip[3, 2] = 1 / half_width, 1 / half_height, 1
    to_clip[2, 2:] = slope, -near * slope
    # z = w', and 1 = w'/near - z'/(near slope): solved from the two rows above.
    from_clip[0, 0], from_clip[1, 1], from_clip[2, 3] = half_width, half_height, 1
    from_clip[3, 2:] = -1 / (near * slope), 1 / near
    return to_clip, from_clip


def _frustum_corners(camera: Camera, view: View) -> np.ndarray:
    """Return the eight corners [m] by walking from the eye along the frame's axes, shape (8, 3)."""
    tangent = np.tan(camera.alpha)
    corners = [
        view.eye + depth * (view.forward + sx * camera.aspect * tangent * view.right + sy * tangent * view.up)
        for depth in (camera.near, camera.far)
        for sx, sy in ((-1, -1), (1, -1), (1, 1), (-1, 1))
    ]
    return np.array(corners)
