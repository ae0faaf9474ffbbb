"""What POV-Ray cannot answer, in sentences."""

import itertools

import numpy as np

from rayproof.cases.placement import world_triangles
from rayproof.cases.scene import Camera, Cube, Mesh, Plane, Scene, Shape, Sphere, Square, Triangle
from rayproof.cases.stages import Stage
from rayproof.reference.povray.program import DEPTH_TOLERANCE, SHADOW_TOLERANCE, missing
from rayproof.reference.povray.worlds import FARTHEST, scale_of

# A shape that measures less than this many of POV-Ray's tolerances no longer tests it.
SMALLEST = 100
CORNERS = np.array(list(itertools.product((-0.5, 0.5), repeat=3)))


def refusal(scene: Scene, stage: Stage) -> str | None:
    """Return why POV-Ray cannot answer `stage` of `scene`, or None if it can."""
    if stage is Stage.CAMERA:
        return "POV-Ray has a camera but no clip space, so no matrices to show."
    return missing() or (None if stage is Stage.RAY else _size(scene))


def _size(scene: Scene) -> str | None:
    scale, eye = scale_of(scene), np.asarray(scene.camera.eye)
    tolerance = (SHADOW_TOLERANCE if scene.lights else DEPTH_TOLERANCE) / scale
    points = [np.asarray([light.position for light in scene.lights]).reshape(-1, 3)]
    for index, shape in enumerate(scene.shapes):
        if isinstance(shape, Plane):
            farthest = _farthest_of(shape, scene)
        else:
            points.append(_corners(shape))
            farthest = 0.0
            size = float(np.ptp(points[-1], axis=0).max())
            if 0 < size < SMALLEST * tolerance:
                return f"POV-Ray's tolerance is {tolerance:.1g} m here, and shapes[{index}] measures only {size:g} m."
        if farthest * scale > FARTHEST:
            return f"POV-Ray sees {FARTHEST / scale:g} m far here, and shapes[{index}] is hit at {farthest:g} m."
    every = np.concatenate(points)
    # From any point to any other, feelers included.
    reach = float(np.linalg.norm(every - eye, axis=1).max(initial=0)) * 2
    if reach * scale > FARTHEST:
        return f"POV-Ray sees {FARTHEST / scale:g} m far here, and the scene reaches {reach:g} m."
    return None


def _farthest_of(plane: Plane, scene: Scene) -> float:
    """Return the largest distance [m] at which a pixel's centre sees the plane inside the clip interval, 0 if none."""
    camera = scene.camera
    matrix = np.asarray(plane.to_world)
    normal = np.linalg.inv(matrix[:3, :3])[2]
    forward = np.subtract(camera.target, camera.eye, dtype=np.float64)
    forward /= np.linalg.norm(forward)
    directions = _directions(camera, forward)
    with np.errstate(all="ignore"):
        distance = (normal @ (matrix[:3, 3] - camera.eye)) / (directions @ normal)
        limit = np.inf if scene.clip == "none" else camera.far
        depth = distance * (directions @ forward) if scene.clip == "depth" else distance
    seen = distance[(distance > 0) & np.isfinite(distance) & (depth < limit)]
    return float(seen.max(initial=0))


def _directions(camera: Camera, forward: np.ndarray) -> np.ndarray:
    """Return unit directions (n, 3) through the pixel centres."""
    right = np.cross(forward, np.asarray(camera.up, dtype=np.float64))
    right /= np.linalg.norm(right)
    rows, columns = np.mgrid[: camera.height, : camera.width] + 0.5
    tangent = np.tan(camera.alpha)
    across = (2 * columns / camera.width - 1)[..., np.newaxis] * tangent * camera.aspect * right
    along = (1 - 2 * rows / camera.height)[..., np.newaxis] * tangent * np.cross(right, forward)
    directions = (forward + across + along).reshape(-1, 3)
    return directions / np.linalg.norm(directions, axis=1, keepdims=True)


def _corners(shape: Shape) -> np.ndarray:
    """Return points (n, 3) [m] whose box holds a finite shape."""
    if isinstance(shape, Triangle | Mesh):
        return world_triangles(shape).reshape(-1, 3).astype(np.float64)
    matrix = np.asarray(shape.to_world)
    if isinstance(shape, Sphere):
        local = np.asarray(shape.center) + 2 * shape.radius * CORNERS
    elif isinstance(shape, Cube | Square):
        local = CORNERS if isinstance(shape, Cube) else CORNERS * (1, 1, 0)
    else:
        raise LookupError(f"POV-Ray has not been taught the shape {type(shape).__name__}")
    return local @ matrix[:3, :3].T + matrix[:3, 3]
