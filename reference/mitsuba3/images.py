"""Radiance as an image from Mitsuba's own `direct` integrator through its own camera."""

from typing import Any

import numpy as np

from rayproof.cases.scene import Camera, Scene
from rayproof.reference.mitsuba3.tracing import Hits
from rayproof.reference.mitsuba3.worlds import World


def radiance(world: World, scene: Scene, integrator: Any, samples: int) -> np.ndarray:
    """Return the mean radiance [W/(m^2 sr)] over samples x samples points per pixel, (lines, width, 3).

    One pass per light, summed here in float64.
    """
    total = np.zeros((scene.camera.lines, scene.camera.width, 3))
    for light in scene.lights:
        world.place(light)
        image = world.mi.render(world.loaded, integrator=integrator, spp=samples * samples, seed=0)
        total += np.asarray(image, dtype=np.float64)
    return total


def clip_planes_beyond(camera: Camera, hits: Hits) -> tuple[float, float]:
    """Return depths [m] of a near and a far plane between which everything that was hit lies with ample room."""
    distance = np.linalg.norm(hits.position[hits.shape >= 0] - np.asarray(camera.eye), axis=1)
    nearest, farthest = distance.min(initial=camera.near), distance.max(initial=camera.far)
    return float(nearest) * 1e-3, float(farthest) * 1e3
