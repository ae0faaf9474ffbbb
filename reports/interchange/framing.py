"""Where to stand and what to light with when a file says neither: everything in view, lit from behind the shoulder."""

from math import pi, radians, sin
from typing import Any

import numpy as np

from rayproof.cases.placement import world_triangles
from rayproof.cases.scene import Camera, Cube, Matrix, Mesh, Plane, PointLight, Shape, Sphere, Square, Triangle, Vector
from rayproof.reports.interchange import Size

FOVY = 40.0  # degrees
SIZE = (320, 240)  # px
DIRECTION = np.array([0.6, -0.7, 0.4])  # from the target to the eye, z upward
MARGIN = 1.1  # of the bounding sphere


def bounds(shapes: tuple[Shape, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Return the lowest and the highest corner [m] of a box around the shapes; a plane counts with its unit square."""
    if not shapes:
        return np.full(3, -1.0), np.full(3, 1.0)
    boxes = [_box(shape) for shape in shapes]
    return np.min([low for low, _ in boxes], axis=0), np.max([high for _, high in boxes], axis=0)


def camera_for(
    shapes: tuple[Shape, ...], size: Size = None, up: tuple[float, float, float] = (0.0, 0.0, 1.0)
) -> Camera:
    """Return a camera that has all shapes in view, with `up` upward."""
    low, high = bounds(shapes)
    center, radius = (low + high) / 2, max(float(np.linalg.norm(high - low)) / 2, float(np.finfo(np.float32).tiny))
    width, height = size or SIZE
    # The narrower of the two angles must hold the bounding sphere.
    half = radians(FOVY) / 2 * min(1.0, width / height)
    distance = MARGIN * radius / sin(half)
    eye = center + distance * _upright(up) @ (DIRECTION / np.linalg.norm(DIRECTION))
    return Camera(
        eye=vector(eye),
        target=vector(center),
        up=up,
        fovy=FOVY,
        width=width,
        height=height,
        near=max(distance - 2 * radius, distance * 1e-3),
        far=distance + 2 * radius,
    )


def light_for(camera: Camera) -> PointLight:
    """Return a white light above the eye's right shoulder that gives about 1 W/m^2 at the target."""
    eye, target, up = (np.asarray(value) for value in (camera.eye, camera.target, camera.up))
    forward = target - eye
    distance = float(np.linalg.norm(forward))
    right = np.cross(forward, up)
    right /= np.linalg.norm(right)
    position = eye + distance * (0.4 * right + 0.5 * np.cross(right, forward / distance))
    flux = 4 * pi * float(np.sum((target - position) ** 2))
    return PointLight(position=vector(position), flux=(flux, flux, flux))


def _upright(up: tuple[float, float, float]) -> np.ndarray:
    """Return a rotation that takes the z axis to `up`."""
    axis = np.asarray(up) / np.linalg.norm(up)
    side = np.cross(np.roll(axis, 1), axis)
    side /= np.linalg.norm(side)
    return np.stack([side, np.cross(axis, side), axis], axis=1)


def _box(shape: Shape) -> tuple[np.ndarray, np.ndarray]:
    if isinstance(shape, Triangle | Mesh):
        corners = world_triangles(shape).reshape(-1, 3).astype(np.float64)
        return corners.min(axis=0), corners.max(axis=0)
    matrix = np.asarray(shape.to_world, dtype=np.float64)
    linear, place = matrix[:3, :3], matrix[:3, 3]
    if isinstance(shape, Sphere):
        center, reach = linear @ np.asarray(shape.center) + place, shape.radius * np.linalg.norm(linear, axis=1)
    elif isinstance(shape, Cube):
        center, reach = place, np.abs(linear).sum(axis=1) / 2
    elif isinstance(shape, Square | Plane):
        center, reach = place, np.abs(linear[:, :2]).sum(axis=1) / 2
    else:
        raise LookupError(f"the extent of a {type(shape).__name__} is not known")
    return center - reach, center + reach


def vector(values: Any) -> Vector:
    """Return three numbers as a tuple of floats."""
    x, y, z = map(float, np.asarray(values, dtype=np.float64))
    return (x, y, z)


def matrix(entries: Any) -> Matrix:
    """Return a 4x4 array as a tuple of rows."""
    first, second, third, last = ((float(a), float(b), float(c), float(d)) for a, b, c, d in np.asarray(entries))
    return (first, second, third, last)
