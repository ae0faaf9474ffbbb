"""Whether the camera's clipping cuts anything that a pixel could see: Tachyon's clipping would cut shadows as well."""

import numpy as np

from rayproof.cases.scene import Camera, Scene
from rayproof.reference.tachyon.surfaces import Ball, Level, surface_of


def cut(scene: Scene) -> str | None:
    """Return the first shape that clipping may cut, in words, or None if it surely cuts nothing in view."""
    if scene.clip == "none":
        return None
    camera = scene.camera
    frame = _frame(camera)
    # Within the view a depth d lies at most this many times farther than d from the eye.
    slope = np.array([np.tan(camera.alpha) * camera.aspect, np.tan(camera.alpha)])
    secant = float(np.hypot(1, np.hypot(*slope)))
    far = camera.far / secant if scene.clip == "shell" else camera.far
    for index, shape in enumerate(scene.shapes):
        surface = surface_of(shape)
        if isinstance(surface, Level):
            safe = _level_safe(
                frame @ surface.normal, float(surface.normal @ (surface.point - camera.eye)), slope, camera, far
            )
        elif isinstance(surface, Ball):
            center = surface.center - camera.eye
            depth, distance = float(frame[2] @ center), float(np.linalg.norm(center))
            # By its depths, or, which also holds from inside, by its distances.
            apart = depth - surface.radius > camera.near or abs(distance - surface.radius) > camera.near * secant
            within = depth + surface.radius < far
            safe = depth + surface.radius < 0 or (apart and within)
        else:
            local = (surface.corners - camera.eye) @ frame.T
            outside = (local[..., 2] <= camera.near) | (local[..., 2] >= far)
            safe = all(_facet_safe(corners, slope, camera.near, far) for corners in local[outside.any(axis=1)])
        if not safe:
            return f"shapes[{index}]"
    return None


def _frame(camera: Camera) -> np.ndarray:
    """Return the camera's axes as rows: right, up, forward."""
    forward = np.subtract(camera.target, camera.eye, dtype=np.float64)
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, np.asarray(camera.up, dtype=np.float64))
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(right, forward), forward])


def _level_safe(normal: np.ndarray, height: float, slope: np.ndarray, camera: Camera, far: float) -> bool:
    """Return whether a plane is met inside (near, far) or not at all; 1 / depth is affine over the image."""
    corners = np.array([[x * slope[0], y * slope[1], 1.0] for x in (-1, 1) for y in (-1, 1)])
    if height == 0:
        return False
    inverse = corners @ normal / height
    return bool(inverse.max() <= 0 or (inverse.min() > 1 / far and inverse.max() < 1 / camera.near))


def _facet_safe(corners: np.ndarray, slope: np.ndarray, near: float, far: float) -> bool:
    """Return whether what the view shows of a triangle lies inside (near, far).

    The triangle (3, 3), in camera axes, is cut by the view's four sides (Sutherland and Hodgman, 1974).
    """
    polygon = list(corners)
    for axis in (0, 1):
        for sign in (-1.0, 1.0):
            side = np.array([0.0, 0.0, slope[axis]])
            side[axis] = sign
            kept: list[np.ndarray] = []
            for start, end in zip(polygon, polygon[1:] + polygon[:1], strict=True):
                before, after = float(side @ start), float(side @ end)
                if before >= 0:
                    kept.append(start)
                if (before >= 0) != (after >= 0):
                    kept.append(start + (end - start) * (before / (before - after)))
            polygon = kept
    depths = [float(corner[2]) for corner in polygon]
    return not depths or (min(depths) > near and max(depths) < far)
