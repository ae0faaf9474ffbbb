"""Rays as unit vectors of camera space, turned into the world.

Source: the specification, CAM-1 and CAM-3; camera space has x right, y up and z forward, so that depth is z.
"""

import numpy as np

from rayproof.cases.scene import Camera, Scene


def orientation(camera: Camera) -> np.ndarray:
    """Return the rotation from camera space to the world: its columns are right, up and forward, (3, 3)."""
    forward = np.array(camera.target, dtype=np.float64) - np.array(camera.eye, dtype=np.float64)
    # Orthonormal columns that span forward and up, in this order; QR may turn any of them around.
    basis, triangle = np.linalg.qr(np.column_stack([forward, camera.up]))
    forward, up = (basis * np.sign(np.diag(triangle))).T
    return np.column_stack([np.cross(forward, up), up, forward])


def directions(camera: Camera) -> tuple[np.ndarray, np.ndarray]:
    """Return unit directions through the pixel centres, (lines * width, 3) row by row, and their depth per metre."""
    half = np.tan(camera.alpha)
    x = (2 * np.arange(camera.width) + 1 - camera.width) / camera.height * half
    rows = camera.first_row + np.arange(camera.lines)
    y = (camera.height - 1 - 2 * rows) / camera.height * half
    local = np.stack([*np.meshgrid(x, y), np.ones((camera.lines, camera.width))], axis=-1).reshape(-1, 3)
    local /= np.sqrt(np.einsum("ij,ij->i", local, local))[:, np.newaxis]
    return local @ orientation(camera).T, local[:, 2]


def interval(scene: Scene, depth: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return from where to where [m] along rays of that depth per metre a hit counts, (n,) each."""
    near, far = scene.camera.near, scene.camera.far
    if scene.clip == "none":
        near, far = 0.0, np.inf
    per_metre = depth if scene.clip == "depth" else np.ones_like(depth)
    return near / per_metre, far / per_metre
