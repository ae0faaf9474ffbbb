"""Mitsuba's perspective sensor as the specification's camera.

Its camera looks along +z with y up and x to the *left*; `fov` is measured along `fov_axis`, by default the
horizontal one; `focal_length` is that of a 35 mm film (36 x 24 mm), by its diagonal.
"""

from collections.abc import Callable
from math import atan, degrees, hypot, radians, tan

import numpy as np

from rayproof.cases.scene import Camera, SceneError
from rayproof.reports.interchange import Size
from rayproof.reports.interchange.mitsuba_xml.tree import Element
from rayproof.reports.interchange.numbers import vector

FILM = (768, 576)  # px; Mitsuba's default
FOCAL_LENGTH = "50mm"
ORTHOGONAL = 1e-9  # cosine; matrices are written with more digits than this


def camera_of(sensor: Element, size: Size, drop: Callable[[str], None]) -> Camera:
    """Return the camera of a perspective (or, its aperture dropped, thin-lens) sensor.

    Raises:
        SceneError: its `to_world` shears, or a value is one that the specification refuses.

    """
    if sensor.plugin == "thinlens":
        drop(f"{sensor.place}: the lens of {sensor.get('aperture_radius', 0)} m; the camera is a pinhole")
    film = next((child for _, child in sensor.children("Film")), None)
    width, height = (
        (int(film.get(name, usual)) for name, usual in zip(("width", "height"), FILM, strict=True)) if film else FILM
    )
    if film is not None and min(width, height) < 1:
        raise SceneError(f"{film.place}: a film must have at least 1 x 1 px, got {width} x {height}")
    if film is not None and any(film.get(f"crop_{name}", 0) for name in ("width", "height", "offset_x", "offset_y")):
        drop(f"{film.place}: the crop window; the whole film is rendered")
    if any(sensor.get(f"principal_point_offset_{axis}", 0) for axis in "xy"):
        drop(f"{sensor.place}: the principal point's offset")
    fovy = _fovy(sensor, width, height)
    width, height = size or (width, height)
    matrix = sensor.matrix()
    axes = matrix[:3, :3] / np.linalg.norm(matrix[:3, :3], axis=0)
    if not np.allclose(axes.T @ axes, np.eye(3), rtol=0, atol=ORTHOGONAL):
        raise SceneError(f"{sensor.place}: the sensor's to_world shears, which no camera of the specification does")
    if np.linalg.det(axes) < 0:
        drop(f"{sensor.place}: the sensor's to_world mirrors the image; this camera does not")
    eye, forward, up = matrix[:3, 3], axes[:, 2], axes[:, 1]
    try:
        return Camera(
            eye=vector(eye),
            target=vector(eye + forward),
            up=vector(up),
            fovy=fovy,
            width=width,
            height=height,
            near=float(sensor.get("near_clip", 1e-2)),
            far=float(sensor.get("far_clip", 1e4)),
        )
    except SceneError as error:
        raise SceneError(f"{sensor.place}: {error}") from None


def _fovy(sensor: Element, width: int, height: int) -> float:
    """Return the full vertical angle [degrees]."""
    if (angle := sensor.get("fov", None)) is not None:
        axis = str(sensor.get("fov_axis", "x"))
        if not 0 < float(angle) < 180:
            raise SceneError(f"{sensor.place}: fov must lie inside (0, 180), got {angle} degrees")
        half = tan(radians(float(angle)) / 2)
    else:
        text = str(sensor.get("focal_length", FOCAL_LENGTH))
        try:
            focal = float(text.removesuffix("mm"))
        except ValueError:
            focal = 0.0
        if not focal > 0:
            raise SceneError(f"{sensor.place}: focal_length must be a length in mm, got {text!r}")
        axis, half = "diagonal", hypot(36.0, 24.0) / 2 / focal
    extents = {
        "x": width,
        "y": height,
        "diagonal": hypot(width, height),
        "smaller": min(width, height),
        "larger": max(width, height),
    }
    if axis not in extents:
        raise SceneError(f"{sensor.place}: fov_axis must be one of {', '.join(extents)}, got {axis!r}")
    return 2 * degrees(atan(half * height / extents[axis]))
