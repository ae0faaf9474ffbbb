"""The task for Cycles as JSON: spheres as points of a cloud, other shapes as triangles; and its EXR read back.

A point under a matrix that is no similarity is another shape, so there are no ellipsoids; all is in world space.
"""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR

from rayproof.cases.placement import world_triangles
from rayproof.cases.scene import (
    Camera,
    Cube,
    Mesh,
    Plane,
    PointLight,
    Scene,
    Shape,
    Sphere,
    Square,
    Triangle,
    is_similarity,
)

BITS = np.array([[(index >> axis) & 1 for axis in range(3)] for index in range(8)]) - 0.5
# The faces of a cube and of a square by corners, counter-clockwise seen from outside.
CUBE = BITS[np.array(((0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6)))]
SQUARE = BITS[np.array([[0, 1, 3, 2]])] * (1, 1, 0)
# Where on its first side a square is parted, towards the corners opposite. A feeler that starts exactly on the seam of
# two triangles is blocked by one of them in Cycles, and a diagonal is where symmetrical scenes have pixels.
PARTED = (3 - 5**0.5) / 2
TRIANGLES = ((0, 4, 3), (4, 2, 3), (4, 1, 2))  # of a square's four corners and the point between the first two


@dataclass(frozen=True, kw_only=True)
class Ball:
    """A sphere in world space."""

    center: np.ndarray  # (3,) m
    radius: float  # m


@dataclass(frozen=True, kw_only=True)
class Facets:
    """Triangles wound outward, each with the number of its face."""

    corners: np.ndarray  # (n, 3, 3) m
    numbers: np.ndarray  # (n,)


def surface_of(shape: Shape) -> Ball | Facets | str:
    """Return the shape in world space, or why Cycles has none like it, for a sentence about the shape.

    Raises:
        LookupError: an unknown kind of shape.

    """
    if isinstance(shape, Triangle | Mesh):
        corners = world_triangles(shape).astype(np.float64)
        sides = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        kept = np.flatnonzero(np.any(sides != 0, axis=1))
        return Facets(corners=corners[kept], numbers=kept)
    matrix = np.asarray(shape.to_world, dtype=np.float64)
    linear, offset = matrix[:3, :3], matrix[:3, 3]
    if isinstance(shape, Plane):
        return "is an infinite plane"
    if isinstance(shape, Sphere):
        if not is_similarity(shape.to_world):
            return "is an ellipsoid"
        scale = float(np.cbrt(abs(np.linalg.det(linear))))
        return Ball(center=linear @ shape.center + offset, radius=shape.radius * scale)
    if not isinstance(shape, Cube | Square):
        raise LookupError(f"Cycles has not been taught the shape {type(shape).__name__}")
    faces = CUBE if isinstance(shape, Cube) else SQUARE
    between = faces[:, :1] + PARTED * (faces[:, 1:2] - faces[:, :1])
    corners = (np.concatenate([faces, between], axis=1) @ linear.T + offset)[:, TRIANGLES].reshape(-1, 3, 3)
    if np.linalg.det(linear) < 0:
        corners = corners[:, [0, 2, 1]]
    return Facets(corners=corners, numbers=np.zeros(len(corners), dtype=int))


# A scene as files for Blender's Python, and its pictures back as arrays.


# One sample: Cycles puts the first one at the pixel's centre.
CYCLES = {
    "samples": 1,
    "use_adaptive_sampling": False,
    "use_denoising": False,
    "max_bounces": 0,
    "pixel_filter_type": "BOX",
    "device": "CPU",
}
# Where nothing is clipped, the depths between which Cycles looks, in units of the distance from eye to target.
NEAREST, FARTHEST = 1e-6, 1e9


def write(folder: Path, scene: Scene, pictures: dict[str, int], samples: int) -> None:
    """Write the task: for each picture, by file name, the index of the light that shines, or -1 for none."""
    shapes = []
    for index, shape in enumerate(scene.shapes):
        looks = {"albedo": shape.albedo, "two_sided": shape.two_sided}
        surface = surface_of(shape)
        if isinstance(surface, Ball):
            shapes.append({"kind": "ball", "center": surface.center.tolist(), "radius": surface.radius, **looks})
        elif isinstance(surface, Facets):
            name = f"shape{index}.npz"
            corners, faces = surface.corners.astype(np.float32), surface.numbers.astype(np.float32)
            np.savez(folder / name, corners=corners, faces=faces)
            shapes.append({"kind": "facets", "file": name, **looks})
        else:
            raise ValueError(f"shapes[{index}] {surface}")
    task = {
        "cycles": CYCLES,
        "camera": _camera(scene, samples),
        "shapes": shapes,
        "lights": [_light(light) for light in scene.lights],
        "pictures": pictures,
    }
    (folder / "task.json").write_text(json.dumps(task), encoding="ascii")


def read(path: Path) -> dict[str, np.ndarray]:
    """Return a picture's channels without the name of their layer, each (height, width), float64."""
    with OpenEXR.File(str(path), separate_channels=True) as file:
        found: dict[str, Any] = {
            name: channel for part in range(len(file.parts)) for name, channel in file.channels(part).items()
        }
        return {name.partition(".")[2]: np.array(found[name].pixels, dtype=np.float64) for name in found}


def pixels(channels: dict[str, np.ndarray], name: str, letters: str) -> np.ndarray:
    """Return the channels `name`.X and so on, (height, width, channels)."""
    return np.stack([channels[f"{name}.{letter}"] for letter in letters], axis=-1)


def _camera(scene: Scene, samples: int) -> dict[str, Any]:
    camera: Camera = scene.camera
    forward = np.subtract(camera.target, camera.eye, dtype=np.float64)
    distance = float(np.linalg.norm(forward))
    forward /= distance
    right = np.cross(forward, np.asarray(camera.up, dtype=np.float64))
    right /= np.linalg.norm(right)
    matrix = np.eye(4)
    # Blender's camera looks along -z.
    matrix[:3, :3] = np.column_stack([right, np.cross(right, forward), -forward])
    matrix[:3, 3] = camera.eye
    near, far = camera.near, camera.far
    if scene.clip == "none":
        near, far = NEAREST * distance, FARTHEST * distance
    return {
        "matrix": matrix.tolist(),
        "fovy": 2 * camera.alpha,
        "near": near,
        "far": far,
        "size": [camera.width * samples, camera.height * samples],
    }


def _light(light: PointLight) -> dict[str, Any]:
    energy = max(light.flux)
    color = [channel / energy for channel in light.flux] if energy > 0 else [0.0] * 3
    return {"position": light.position, "energy": energy, "color": color}
