"""The rays that rtrace is handed: a Radiance view (-vtv) by its direction and its horizontal and vertical extent.

Source: rpict(1), "-vp -vd -vu -vh -vv": an image point (x, y) in [0, 1]^2, y upwards, is seen along
direction + (x - 1/2) horizontal + (y - 1/2) vertical.
"""

from collections.abc import Iterator

import numpy as np

from rayproof.cases.scene import Camera, Scene

# Rays of a supersampled image that are in memory at once.
AT_ONCE = 2**20


def view(camera: Camera) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the unit viewing direction and the image's horizontal and vertical extent one unit ahead, (3,) each."""
    direction = np.asarray(camera.target, dtype=np.float64) - np.asarray(camera.eye, dtype=np.float64)
    direction /= np.linalg.norm(direction)
    up = np.asarray(camera.up, dtype=np.float64)
    # The part of `up` that the direction leaves, and the third axis from both.
    vertical = up - (up @ direction) * direction
    vertical /= np.linalg.norm(vertical)
    horizontal = np.cross(direction, vertical)
    height = 2.0 * np.tan(camera.alpha)
    return direction, horizontal * (height * camera.width / camera.height), vertical * height


def through(camera: Camera, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return unit directions (n, 3) through image points in pixels from the top left, and their cosine with F (n,)."""
    direction, horizontal, vertical = view(camera)
    across = (x / camera.width - 0.5)[:, np.newaxis]
    upward = (0.5 - y / camera.height)[:, np.newaxis]
    towards = direction + across * horizontal + upward * vertical
    length = np.linalg.norm(towards, axis=1)
    return towards / length[:, np.newaxis], 1.0 / length


def centers(camera: Camera) -> tuple[np.ndarray, np.ndarray]:
    """Return x and y [px] of the pixels' centres, row by row from the top left, (lines * width,) each."""
    y, x = np.indices((camera.lines, camera.width))
    return x.ravel() + 0.5, y.ravel() + (camera.first_row + 0.5)


def parts(camera: Camera, samples: int) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield x and y [px] of the centres of samples x samples parts of every pixel, pixel after pixel, in portions.

    Each portion holds whole rounds over the image: shape (rounds * height * width,).
    """
    x, y = centers(camera)
    offsets = (np.arange(samples) + 0.5) / samples - 0.5
    moves = [(right, down) for down in offsets for right in offsets]
    rounds = max(1, AT_ONCE // len(x))
    for first in range(0, len(moves), rounds):
        some = moves[first : first + rounds]
        yield (
            np.concatenate([x + right for right, _ in some]),
            np.concatenate([y + down for _, down in some]),
        )


def interval(scene: Scene, cosine: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return from where to where [m] along unit directions of that cosine with F a hit counts, (n,) each."""
    camera = scene.camera
    if scene.clip == "depth":
        return camera.near / cosine, camera.far / cosine
    if scene.clip == "shell":
        return np.full_like(cosine, camera.near), np.full_like(cosine, camera.far)
    return np.zeros_like(cosine), np.full_like(cosine, np.inf)
