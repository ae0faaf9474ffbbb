"""Camera and light for files that have none: everything in view, lit from behind the right shoulder."""

from dataclasses import replace
from math import pi, radians, sin
from typing import Any, Literal

import numpy as np

from rayproof.cases.placement import frame, placed, world_triangles
from rayproof.cases.scene import (
    Camera,
    Cube,
    Matrix,
    Mesh,
    Plane,
    PointLight,
    Scene,
    Shape,
    Sphere,
    Square,
    Triangle,
    Vector,
)
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Analytic
from rayproof.reports.interchange import Size

FOVY = 40.0  # degrees
SIZE = (320, 240)  # px
# From the target to the eye: in front of the object and to its right, by the axis that points up. Front is -y where z
# points up (Blender, CAD) and +z where y does (glTF 2.0, section 3.4).
DIRECTIONS = {"z": (0.6, -0.7, 0.4), "y": (0.6, 0.4, 0.7)}
UP = {"z": (0.0, 0.0, 1.0), "y": (0.0, 1.0, 0.0)}
MARGIN = 1.1  # of the bounding sphere
PIXELS, RAY_TRIANGLES = (
    (35.0, 800.0),
    2e7,
)  # of the images that determine the visible part, and rays times triangles of each

DARK = "no pixel of it is lit: every surface in view is in shadow, or turned away from camera or lights"


def bounds(shapes: tuple[Shape, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Return the lowest and the highest corner [m] of a box around the shapes; of a plane, around its unit square."""
    if not shapes:
        return np.full(3, -1.0), np.full(3, 1.0)
    boxes = [box(shape) for shape in shapes]
    return np.min([low for low, _ in boxes], axis=0), np.max([high for _, high in boxes], axis=0)


def camera_for(shapes: tuple[Shape, ...], size: Size = None, *, up: Literal["y", "z"]) -> Camera:
    """Return a camera that has all shapes in view, from in front of them, with the axis `up` upward."""
    low, high = bounds(shapes)
    center, radius = (low + high) / 2, max(float(np.linalg.norm(high - low)) / 2, float(np.finfo(np.float32).tiny))
    width, height = size or SIZE
    # The narrower of the two angles must contain the bounding sphere.
    half = radians(FOVY) / 2 * min(1.0, width / height)
    distance = MARGIN * radius / sin(half)
    eye = center + distance * np.array(DIRECTIONS[up]) / np.linalg.norm(DIRECTIONS[up])
    return Camera(
        eye=vector(eye),
        target=vector(center),
        up=UP[up],
        fovy=FOVY,
        width=width,
        height=height,
        near=max(distance - 2 * radius, distance * 1e-3),
        far=distance + 2 * radius,
    )


def light_for(camera: Camera, shapes: tuple[Shape, ...]) -> tuple[PointLight, str | None]:
    """Return a white light for the visible part, and a sentence if it cannot light any visible surface.

    It is above and to the right of the eye, at a distance that depends on the visible surface nearest to the image's
    centre, or closer to the eye if that point would be dark, and its irradiance there is 1 W/m^2.
    """
    scene = Scene(camera=replace(camera, **_grid(camera, shapes)), shapes=shapes, lights=())
    positions = Analytic().render(scene, [Stage.POSITION])[Stage.POSITION]
    surfaces = np.argwhere(np.isfinite(positions).all(axis=-1))
    eye, forward, up = (np.asarray(value) for value in (camera.eye, np.subtract(camera.target, camera.eye), camera.up))
    right, above, _ = frame(eye, camera.target, up)
    middle = (np.array(positions.shape[:2]) - 1) / 2
    row, column = min(surfaces.tolist(), key=lambda pixel: float(np.sum((pixel - middle) ** 2)), default=(0, 0))
    distance = float(np.linalg.norm(positions[row, column] - eye)) if len(surfaces) else float(np.linalg.norm(forward))
    for nearer in (1.0, 0.25, 0.05):
        position = vector(eye + nearer * distance * (0.4 * right + 0.5 * above))
        strength = 4 * pi * distance**2
        unit = PointLight(position=position, flux=(strength, strength, strength))
        irradiance = Analytic().render(replace(scene, lights=(unit,)), [Stage.IRRADIANCE])[Stage.IRRADIANCE]
        if len(surfaces) and irradiance[row, column, 0] > 0:
            flux = strength / float(irradiance[row, column, 0])
            return PointLight(position=position, flux=(flux, flux, flux)), None
    dark = "what is nearest to its centre" if len(surfaces) else "nothing"
    return unit, f"no light can be placed so that it is lit: the camera shows {dark}, and that from its unlit side"


def is_dark(scene: Scene) -> bool:
    """Return whether no pixel of a small image of the scene is lit."""
    small = replace(scene, camera=replace(scene.camera, **_grid(scene.camera, scene.shapes)))
    return not (Analytic().render(small, [Stage.RADIANCE])[Stage.RADIANCE] > 0).any()


def _grid(camera: Camera, shapes: tuple[Shape, ...]) -> dict[str, int]:
    """Return width and height of a small image, an odd number each: fewer pixels if there are many triangles."""
    triangles = sum(len(shape.faces) for shape in shapes if isinstance(shape, Mesh)) + len(shapes)
    pixels = float(np.clip(RAY_TRIANGLES / max(1, triangles), *PIXELS))
    aspect = camera.width / camera.height
    height = min(max(1.0, (pixels / aspect) ** 0.5), camera.height)
    width = min(max(1.0, height * aspect), camera.width)
    return {"width": 2 * int(width / 2) + 1, "height": 2 * int(height / 2) + 1}


def box(shape: Shape) -> tuple[np.ndarray, np.ndarray]:
    """Return the lowest and the highest corner [m] of a box around a shape; of a plane, of its unit square."""
    if isinstance(shape, Triangle | Mesh):
        corners = world_triangles(shape).reshape(-1, 3).astype(np.float64)
        return corners.min(axis=0), corners.max(axis=0)
    linear, place = placed(shape)
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
