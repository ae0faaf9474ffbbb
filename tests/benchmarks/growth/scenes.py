"""As many small scenes as asked for, no two alike: a sphere on a square under a light, seen from anywhere."""

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from rayproof.cases.placement import camera_around
from rayproof.cases.scene import PointLight, Scene, Sphere, Square
from rayproof.cases.scene_json import scene_to_json

WIDTH, HEIGHT = 24, 16
SEED = 6


def small_scenes(count: int) -> Iterator[Scene]:
    """Yield `count` scenes; the first ones are the same whatever the count."""
    return (_scene(np.random.default_rng((SEED, index))) for index in range(count))


def write_scenes(count: int, path: Path) -> None:
    """Write `count` scenes, each on a line of a file."""
    with path.open("w", encoding="utf-8") as file:
        for scene in small_scenes(count):
            file.write(f"{json.dumps(scene_to_json(scene))}\n")


def _scene(generator: np.random.Generator) -> Scene:
    camera = camera_around(
        (0.0, 0.0, 0.0),
        distance=float(generator.uniform(4, 6)),
        azimuth=float(generator.uniform(-180, 180)),
        elevation=float(generator.uniform(15, 60)),
        width=WIDTH,
        height=HEIGHT,
        fovy=40.0,
    )
    x, y, z = map(float, generator.uniform(-0.3, 0.3, 3))
    ball = Sphere(albedo=(0.7, 0.5, 0.3), center=(x, y, z), radius=float(generator.uniform(0.4, 0.7)))
    floor = Square(albedo=(0.4, 0.6, 0.8), to_world=((4, 0, 0, 0), (0, 4, 0, 0), (0, 0, 1, -1.1), (0, 0, 0, 1)))
    across, along = map(float, generator.uniform(-2, 2, 2))
    light = PointLight(position=(across, along, 4.0), flux=(90.0, 70.0, 50.0))
    return Scene(camera=camera, shapes=(ball, floor), lights=(light,))
