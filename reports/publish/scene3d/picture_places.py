"""Where things are in a picture of a scene: what is framed, the camera's frustum, which rays are drawn and how far."""

from functools import lru_cache
from typing import Any

import numpy as np

from rayproof.cases.scene import Camera, Scene
from rayproof.reports.publish.scene3d.picture_shapes import surface

MOST_RAYS = 24


def framing(scene: Scene, points: np.ndarray) -> tuple[np.ndarray, float]:
    """Return what to look at [m] and its size [m]: the hits, the bounded shapes near them and, unless far, the eye."""
    eye = np.asarray(scene.camera.eye, dtype=np.float64)
    # Hits out to the horizon would shrink everything else to nothing: the middle nine tenths decide.
    corners = [np.quantile(points, (0.05, 0.95), axis=0)] if len(points) else []
    corners += [bounds for shape in scene.shapes if (bounds := _corners(shape)) is not None]
    inside = np.concatenate(corners) if corners else np.asarray([scene.camera.target], dtype=np.float64)
    low, high = inside.min(axis=0), inside.max(axis=0)
    size = float(np.linalg.norm(high - low)) or float(np.linalg.norm(eye - inside[0])) or 1.0
    others = [eye, *(np.asarray(light.position, dtype=np.float64) for light in scene.lights)]
    near = [point for point in others if np.linalg.norm(point - (low + high) / 2) < 2.5 * size]
    everything = np.concatenate([inside, np.asarray(near).reshape(-1, 3)])
    low, high = everything.min(axis=0), everything.max(axis=0)
    return (low + high) / 2, float(np.linalg.norm(high - low)) or 1.0


@lru_cache(maxsize=64)  # asked for by the picture and by the 3-D view
def _corners(shape: Any) -> np.ndarray | None:
    mesh = surface(shape, patch=None)
    return None if mesh is None else np.asarray(mesh.bounds).reshape(3, 2).T.astype(np.float64)


def frustum(camera: Camera, extent: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the ends [m] of the frustum's edges, two rows each, and of a tick above its upper edge, which is up."""
    eye, forward, right, up = basis(camera)
    depth = 0.12 * extent
    half = depth * np.tan(camera.alpha)
    ends = [
        eye + depth * forward + sx * half * camera.aspect * right + sy * half * up
        for sx, sy in ((-1, -1), (1, -1), (1, 1), (-1, 1))
    ]
    lines = [(eye, end) for end in ends] + [(ends[i], ends[(i + 1) % 4]) for i in range(4)]
    tick = (ends[2] + ends[3]) / 2
    return np.asarray(lines, dtype=np.float64).reshape(-1, 3), np.asarray([tick, tick + 0.25 * half * up])


def few(points: np.ndarray, most: int = MOST_RAYS) -> np.ndarray:
    """Return at most `most` rows, evenly spaced."""
    return points[np.linspace(0, len(points) - 1, min(len(points), most)).astype(int)] if len(points) else points


def ray_ends(eye: np.ndarray, ends: np.ndarray, extent: float) -> np.ndarray:
    """Return the ends [m] of rays from the eye to `ends`, two rows each; from afar only their last stretch."""
    back = eye - ends
    length = np.linalg.norm(back, axis=-1, keepdims=True)
    # From afar only the last stretch: lines a kilometre long lose their digits in the depth buffer.
    starts = ends + back * np.minimum(1, 4 * extent / np.maximum(length, 1e-300))
    return np.stack([starts, ends], axis=1).reshape(-1, 3)


def basis(camera: Camera) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return eye, forward, right and up; all but the first unit."""
    eye = np.asarray(camera.eye, dtype=np.float64)
    forward = np.asarray(camera.target, dtype=np.float64) - eye
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, np.asarray(camera.up, dtype=np.float64))
    right /= np.linalg.norm(right)
    return eye, forward, right, np.cross(right, forward)
