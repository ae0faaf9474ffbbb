"""A scene as files for Blender's Python, and its pictures back as arrays."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR

from rayproof.cases.scene import Camera, PointLight, Scene
from rayproof.reference.cycles.surfaces import Ball, Facets, surface_of

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
