"""Closed forms in float64 that the tests compare Mitsuba with, written for them alone."""

import numpy as np

from rayproof.cases.scene import Camera, Scene
from rayproof.cases.stages import Stage

GENERIC = Camera(
    eye=(1.3, -4.1, 2.2),
    target=(0.1, 0.2, 0.3),
    up=(0.2, 0.1, 1.0),
    fovy=37.0,
    width=40,
    height=30,
    near=0.5,
    far=50.0,
)
SHEARED = ((1.0, 0.5, 0.2, 0.3), (0.1, 1.2, 0.3, 0.1), (0.1, -0.2, 0.8, 0.2), (0.0, 0.0, 0.0, 1.0))
MIRRORED = ((-0.9, 0.3, 0.1, 0.2), (0.2, 1.1, 0.3, 0.1), (0.1, -0.2, 0.8, 0.2), (0.0, 0.0, 0.0, 1.0))
WHITE = (1.0, 1.0, 1.0)
HIT = (Stage.OBJECT, Stage.DISTANCE, Stage.POSITION, Stage.NORMAL)


def directions(camera: Camera, samples: int = 1) -> np.ndarray:
    """Return unit directions, (height, width, samples^2, 3), through the centres of each pixel's parts."""
    forward = np.subtract(camera.target, camera.eye)
    forward = forward / np.linalg.norm(forward)
    right = np.cross(forward, camera.up)
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)
    parts = (np.arange(samples) + 0.5) / samples
    x = ((np.arange(camera.width)[:, None] + parts) / camera.width * 2 - 1)[None, :, None, :, None]
    y = (1 - (np.arange(camera.height)[:, None] + parts) / camera.height * 2)[:, None, :, None, None]
    half = np.tan(np.radians(camera.fovy) / 2)
    through = forward + x * half * camera.width / camera.height * right + y * half * up
    through = through.reshape(camera.height, camera.width, samples * samples, 3)
    return through / np.linalg.norm(through, axis=-1, keepdims=True)


def unit_sphere_roots(camera: Camera, to_world: tuple) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return both distances (NaN where missed) to a placed unit sphere and how deep in it the ray passes, in 0..1."""
    inverse = np.linalg.inv(to_world)
    origin = inverse[:3, :3] @ camera.eye + inverse[:3, 3]
    ray = directions(camera)[:, :, 0] @ inverse[:3, :3].T
    a, b, c = (ray**2).sum(-1), ray @ origin, origin @ origin - 1
    depth = b**2 - a * c
    root = np.sqrt(np.where(depth > 0, depth, np.nan))
    return (-b - root) / a, (-b + root) / a, depth / a


def gradient_normals(to_world: tuple, positions: np.ndarray, local_normal) -> np.ndarray:
    """Return world normals as the gradient of a function whose object-space gradient is `local_normal(point)`."""
    inverse = np.linalg.inv(to_world)
    local = positions @ inverse[:3, :3].T + inverse[:3, 3]
    world = local_normal(local) @ inverse[:3, :3]
    return world / np.linalg.norm(world, axis=-1, keepdims=True)


def looking_down(*, height: float, width: int = 33, rows: int = 25, fovy: float = 40.0, near=0.1, far=100.0) -> Camera:
    """Return a camera above the origin that looks along -z with +y up in the image."""
    about = {"fovy": fovy, "width": width, "height": rows, "near": near, "far": far}
    return Camera(eye=(0, 0, height), target=(0, 0, 0), up=(0, 1, 0), **about)


def answer(mitsuba, scene: Scene, *stages: Stage, samples: int = 1) -> list[np.ndarray]:
    """Return the answers to `stages`, in their order."""
    for stage in stages:
        assert mitsuba.unsupported(scene, stage) is None
    found = mitsuba.render(scene, stages, samples=samples)
    return [found[stage] for stage in stages]
