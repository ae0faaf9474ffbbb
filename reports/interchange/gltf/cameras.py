"""glTF perspective cameras: they look along -z with y up; `yfov` in radians is the full vertical angle (3.10)."""

from collections.abc import Callable
from math import degrees

import numpy as np

from rayproof.cases.scene import Camera, SceneError
from rayproof.reports.interchange import Size
from rayproof.reports.interchange.framing import SIZE
from rayproof.reports.interchange.gltf.entries import CameraEntry
from rayproof.reports.interchange.numbers import vector

NO_END = 1e5  # an infinite projection's far plane, in units of its near plane


def camera_of(camera: CameraEntry, to_world: np.ndarray, size: Size, drop: Callable[[str], None]) -> Camera | None:
    """Return a perspective camera, placed; None for an orthographic one, and say so.

    Raises:
        SceneError: a value is missing, or one that the specification refuses.

    """
    if camera.get("type") != "perspective":
        drop(f"a camera of type {camera.get('type')!r}")
        return None
    lens = camera.get("perspective", {})
    try:
        yfov, near = float(lens["yfov"]), float(lens["znear"])
        far = float(lens.get("zfar", NO_END * near))
        aspect = float(lens.get("aspectRatio", SIZE[0] / SIZE[1]))
    except (KeyError, TypeError, ValueError) as error:
        raise SceneError(f"a perspective camera needs the numbers yfov and znear: {error}") from None
    if "zfar" not in lens:
        drop(f"the camera's view without end; it ends at {far:g} m")
    height = SIZE[1]
    linear = to_world[:3, :3]
    if np.linalg.det(linear) < 0:
        drop("the mirror in a camera's matrix; the image is not mirrored")
    width, height = size or (max(1, round(height * aspect)), height)
    eye, forward = to_world[:3, 3], -linear[:, 2] / np.linalg.norm(linear[:, 2])
    return Camera(
        eye=vector(eye),
        target=vector(eye + forward),
        up=vector(linear[:, 1]),
        fovy=degrees(yfov),
        width=width,
        height=height,
        near=near,
        far=far,
    )
