"""Irradiance, exitance and radiance of diffuse surfaces under point lights (RAD-1 to RAD-4, `two_sided`).

Source: an isotropic source of flux Phi sends Phi / (4 pi) into a unit solid angle, and a surface element at distance r
whose normal is turned by theta fills cos(theta) / r^2 of it.
"""

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.reference.analytic.vectors import dot, length


def irradiance(scene: Scene, positions: np.ndarray, normals: np.ndarray, visible: np.ndarray) -> np.ndarray:
    """Return E [W/m^2] per channel, the sum over visible lights, shape (N, 3)."""
    total = np.zeros((len(positions), 3))
    with np.errstate(all="ignore"):
        for column, light in enumerate(scene.lights):
            offset = np.asarray(light.position) - positions
            # Scaled by its greatest component: r^2 alone could overflow, or vanish.
            size = np.abs(offset).max(axis=1)
            scaled = offset / size[:, np.newaxis]
            stretch = length(scaled)
            cosine = np.clip(dot(normals, scaled) / stretch, 0, None)
            lit = (visible[:, column] > 0) & (cosine > 0)
            for channel in range(3):
                if scene.shading == "simplified":
                    part = light.flux[channel] * np.minimum(cosine, 1)
                else:
                    part = light.flux[channel] / (4 * np.pi) * cosine / stretch / stretch / size / size
                total[:, channel] += np.where(lit, part, 0)
    return total


def exitance(scene: Scene, objects: np.ndarray, arriving: np.ndarray) -> np.ndarray:
    """Return M = albedo E [W/m^2], shape (N, 3)."""
    # A number that is no shape's comes from a renderer under test: nothing is lit there, as on a miss.
    known = (objects[:, 0] >= 0) & (objects[:, 0] < len(scene.shapes))
    albedos = np.array([*(shape.albedo for shape in scene.shapes), (0.0, 0.0, 0.0)])
    albedo = albedos[np.where(known, objects[:, 0], -1).astype(int)]
    with np.errstate(all="ignore"):
        # A black surface under an infinite irradiance is black, not NaN.
        return np.where(albedo == 0, 0, albedo * arriving)


def radiance(
    scene: Scene, directions: np.ndarray, objects: np.ndarray, normals: np.ndarray, leaving: np.ndarray
) -> np.ndarray:
    """Return L [W/(m^2 sr)] towards the camera, 0 from behind a one-sided surface, shape (N, 3).

    A two-sided surface needs no question of its own: its normal is turned towards the viewer already.
    """
    seen = (objects[:, 0] >= 0) & (dot(normals, directions) < 0)
    scale = 1.0 if scene.shading == "simplified" else 1 / np.pi
    return np.where(seen[:, np.newaxis], leaving * scale, 0)
