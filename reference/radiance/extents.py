"""How large a scene is, and the unit of length in which rtrace gets it.

rtrace has one absolute length, FTINY = 1e-6 (fvect.h): hits nearer than that are not seen, smaller spheres are
refused, surfaces nearer to each other than that coincide. So a scene is handed over in units in which its largest
coordinate lies between 512 and 1024; a power of two, so that no number is rounded on the way.
"""

import itertools
from functools import lru_cache
from math import frexp, inf

import numpy as np

from rayproof.cases.placement import world_triangles
from rayproof.cases.scene import Cube, Mesh, Plane, Scene, Shape, Sphere, Square, Triangle

FTINY = 1e-6  # in rtrace's units
LARGEST_EXPONENT = 10
# A plane's disc reaches at most this many times as far as everything else: rtrace knows nothing beyond 1e10 units.
HORIZON = 1e6
# It reaches a thousandth beyond what it must cover, so that its rim is never in play.
MARGIN = 1.001
CUBE_CORNERS = np.array(list(itertools.product((-0.5, 0.5), repeat=3)))
SQUARE_CORNERS = np.array([(-0.5, -0.5, 0.0), (0.5, -0.5, 0.0), (0.5, 0.5, 0.0), (-0.5, 0.5, 0.0)])


def scale(scene: Scene) -> float:
    """Return rtrace's units per metre, a power of two."""
    return 2.0 ** (LARGEST_EXPONENT - frexp(extent(scene))[1])


@lru_cache(maxsize=4)
def extent(scene: Scene) -> float:
    """Return the largest distance [m] from the origin, along an axis, of the eye, a light or a finite shape.

    A plane counts by its distance from the eye.
    """
    places = [scene.camera.eye, *(light.position for light in scene.lights)]
    largest = [float(np.abs(places).max())]
    for shape in scene.shapes:
        if isinstance(shape, Plane):
            largest.append(abs(height(shape, scene.camera.eye)[0]))
        else:
            low, high = box(shape)
            largest.append(float(np.maximum(np.abs(low), np.abs(high)).max()))
    # A scene of nothing but an eye at the origin has no size: any unit will do.
    return max(largest) or 1.0


@lru_cache(maxsize=256)
def box(shape: Shape) -> tuple[np.ndarray, np.ndarray]:
    """Return the lowest and highest world coordinates [m] of a finite shape, (3,) each."""
    if isinstance(shape, Triangle | Mesh):
        corners = world_triangles(shape).reshape(-1, 3).astype(np.float64)
        return corners.min(axis=0), corners.max(axis=0)
    matrix = np.asarray(shape.to_world, dtype=np.float64)
    if isinstance(shape, Sphere):
        center = matrix[:3, :3] @ np.asarray(shape.center) + matrix[:3, 3]
        half = shape.radius * np.sqrt((matrix[:3, :3] ** 2).sum(axis=1))
        return center - half, center + half
    if isinstance(shape, Cube | Square):
        corners = placed(matrix, CUBE_CORNERS if isinstance(shape, Cube) else SQUARE_CORNERS)
        return corners.min(axis=0), corners.max(axis=0)
    raise TypeError(f"{type(shape).__name__} has no box")


def placed(matrix: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return object-space points (n, 3) in world space."""
    return points @ matrix[:3, :3].T + matrix[:3, 3]


def height(plane: Plane, point: tuple[float, float, float]) -> tuple[float, np.ndarray]:
    """Return a point's signed height [m] above the plane and the plane's unit normal (3,)."""
    matrix = np.asarray(plane.to_world, dtype=np.float64)
    # The inverse transpose's third column, without the inverse: a mirror turns the cross product around.
    normal = np.cross(matrix[:3, 0], matrix[:3, 1]) * np.sign(np.linalg.det(matrix[:3, :3]))
    normal /= np.linalg.norm(normal)
    return float(normal @ (np.asarray(point) - matrix[:3, 3])), normal


def reach(scene: Scene) -> float:
    """Return the radius [m] of the discs that stand in for planes, each about the foot of the eye.

    Feelers run between what the camera sees and the lights, so a ball about the eye that holds both holds every
    crossing of a feeler with the plane too.
    """
    camera = scene.camera
    vertical = np.tan(camera.alpha)
    farthest = inf if scene.clip == "none" else camera.far * float(np.sqrt(1 + vertical**2 * (1 + camera.aspect**2)))
    lights = [float(np.linalg.norm(np.subtract(light.position, camera.eye))) for light in scene.lights]
    return min(MARGIN * max(farthest, *lights) if lights else MARGIN * farthest, HORIZON * extent(scene))
