"""An infinite plane as a disc: Mitsuba has no plane.

A disc and not a square, because Mitsuba's `rectangle` is two triangles whose hit points carry the rounding of their
corners (3 cm off for half a width of 1000 km), while its `disk` is intersected in its own plane and keeps its digits
at any size.
"""

import numpy as np

from rayproof.cases.scene import Plane, Scene
from rayproof.reference.mitsuba3.extents import farthest_visible

# The disc reaches a thousandth beyond what it must cover, so that its rim is never in play.
MARGIN = 1.001
# Without a far plane nothing bounds the view: the disc then reaches this many times farther than the scene's own
# lengths, so that only rays within a millionth of a radian of the horizon pass it by.
HORIZON = 1e6


def reach(scene: Scene) -> float:
    """Return how far [m] from the eye every plane must be present.

    Feelers run between points that the camera sees and lights, so a ball about the eye that holds both holds every
    crossing of a feeler with the plane too.
    """
    camera = scene.camera
    lights = [float(np.linalg.norm(np.subtract(light.position, camera.eye))) for light in scene.lights]
    farthest = max(farthest_visible(camera), *lights) if lights else farthest_visible(camera)
    if scene.clip != "none":
        return MARGIN * farthest
    heights = [abs(_height(plane, camera.eye)[0]) for plane in scene.shapes if isinstance(plane, Plane)]
    return HORIZON * max(farthest, *heights) if heights else HORIZON * farthest


def disc_to_world(plane: Plane, scene: Scene) -> np.ndarray:
    """Return the 4x4 matrix that takes Mitsuba's unit disc, facing +z, to the part of the plane around the eye."""
    height, normal = _height(plane, scene.camera.eye)
    # Any two orthonormal directions do: the disc is round.
    seed = np.eye(3)[np.argmin(np.abs(normal))]
    first = np.cross(seed, normal)
    first /= np.linalg.norm(first)
    second = np.cross(normal, first)
    radius = reach(scene)
    matrix = np.eye(4)
    matrix[:3, :3] = np.column_stack([first * radius, second * radius, normal])
    matrix[:3, 3] = np.asarray(scene.camera.eye) - height * normal
    return matrix


def _height(plane: Plane, point: tuple[float, float, float]) -> tuple[float, np.ndarray]:
    """Return a point's signed height [m] above the plane and the plane's unit world normal."""
    matrix = np.asarray(plane.to_world, dtype=np.float64)
    normal = np.linalg.inv(matrix[:3, :3]).T[:, 2]
    normal = normal / np.linalg.norm(normal)
    return float(normal @ (np.asarray(point) - matrix[:3, 3])), normal
