"""A model file for Tachyon: spheres, planes and triangles in world space, and what clipping or backs forbid.

Tachyon takes no matrices. So a sphere must stay one, cubes are twelve triangles and squares two.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rayproof.cases.placement import world_triangles
from rayproof.cases.scene import Camera, Cube, Mesh, Plane, Scene, Shape, Sphere, Square, Triangle

# Outward triangles of the cube and the square by their corners' bits of x, y, z (0: -0.5, 1: +0.5).
CORNERS = np.array([[(index >> axis) & 1 for axis in range(3)] for index in range(8)]) - 0.5
CUBE = ((0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6))


@dataclass(frozen=True, kw_only=True)
class Ball:
    """A sphere in world space."""

    center: np.ndarray  # (3,) m
    radius: float  # m


@dataclass(frozen=True, kw_only=True)
class Level:
    """An infinite plane."""

    point: np.ndarray  # (3,) m
    normal: np.ndarray  # (3,) unit


@dataclass(frozen=True, kw_only=True)
class Facets:
    """Triangles, each with the number of its face; their winding is outward."""

    corners: np.ndarray  # (n, 3, 3) m
    numbers: np.ndarray  # (n,)


Surface = Ball | Level | Facets


def surface_of(shape: Shape) -> Surface:
    """Return the shape in world space.

    Raises:
        LookupError: an unknown kind of shape.

    """
    if isinstance(shape, Triangle | Mesh):
        corners = world_triangles(shape).astype(np.float64)
        kept = np.flatnonzero(_area(corners) & _area(_object_corners(shape)))
        return Facets(corners=corners[kept], numbers=kept)
    matrix = np.asarray(shape.to_world, dtype=np.float64)
    linear, offset = matrix[:3, :3], matrix[:3, 3]
    if isinstance(shape, Sphere):
        scale = np.cbrt(abs(np.linalg.det(linear)))
        return Ball(center=linear @ shape.center + offset, radius=float(shape.radius * scale))
    if isinstance(shape, Plane):
        normal = np.linalg.inv(linear)[2]
        return Level(point=offset, normal=normal / np.linalg.norm(normal))
    if isinstance(shape, Cube):
        faces = CORNERS[np.array(CUBE)]
    elif isinstance(shape, Square):
        faces = np.array([[[-0.5, -0.5, 0.0], [0.5, -0.5, 0.0], [0.5, 0.5, 0.0], [-0.5, 0.5, 0.0]]])
    else:
        raise LookupError(f"Tachyon has not been taught the shape {type(shape).__name__}")
    corners = (faces @ linear.T + offset)[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3, 3)
    if np.linalg.det(linear) < 0:
        corners = corners[:, [0, 2, 1]]
    return Facets(corners=corners, numbers=np.zeros(len(corners), dtype=int))


def _object_corners(shape: Triangle | Mesh) -> np.ndarray:
    if isinstance(shape, Triangle):
        return np.asarray(shape.vertices, dtype=np.float64)[np.newaxis]
    return shape.vertices.astype(np.float64)[shape.faces]


def _area(corners: np.ndarray) -> np.ndarray:
    """Return which triangles have an area."""
    return np.any(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) != 0, axis=1)


# Whether the camera's clipping cuts anything that a pixel could see: Tachyon's clipping would cut shadows as well.


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


# A scene in Tachyon's model format: the camera, and the surfaces in the colours of the question.


@dataclass(frozen=True, kw_only=True)
class Look:
    """The appearance of a facet."""

    color: tuple[float, ...]  # per channel
    shines: bool  # by itself, whatever the light; else it is an albedo


# (shape, its surface, its index in the scene) -> a look per facet, or the one of a sphere or plane
Paint = Callable[[Shape, Surface, int], list[Look]]


def model(scene: Scene, paint: Paint, lights: str = "") -> str:
    """Return the whole model."""
    parts = ["BEGIN_SCENE", "RESOLUTION 8 8", _camera(scene.camera), "BACKGROUND 0 0 0", lights]
    for index, shape in enumerate(scene.shapes):
        surface = surface_of(shape)
        parts += _objects(surface, [_texture(look) for look in paint(shape, surface, index)])
    return "\n".join([*parts, "END_SCENE", ""])


def numbers(values: object) -> str:
    """Return numbers with every digit of float64, of which Tachyon's reader keeps float32's."""
    return " ".join(f"{value:.17g}" for value in np.ravel(np.asarray(values, dtype=np.float64)).tolist())


def _camera(camera: Camera) -> str:
    forward = np.subtract(camera.target, camera.eye, dtype=np.float64)
    # Tachyon's image is one unit high at `zoom` from the eye.
    return f"""CAMERA
  ZOOM {0.5 / np.tan(camera.alpha):.17g}
  ASPECTRATIO 1
  ANTIALIASING 0
  RAYDEPTH 1
  CENTER {numbers(camera.eye)}
  VIEWDIR {numbers(forward / np.linalg.norm(forward))}
  UPDIR {numbers(camera.up)}
END_CAMERA"""


def _texture(look: Look) -> str:
    ambient, diffuse = (1, 0) if look.shines else (0, 1)
    return f"TEXTURE AMBIENT {ambient} DIFFUSE {diffuse} SPECULAR 0 OPACITY 1 COLOR {numbers(look.color)} TEXFUNC 0"


def _objects(surface: Surface, textures: list[str]) -> list[str]:
    if isinstance(surface, Ball):
        return [f"SPHERE CENTER {numbers(surface.center)} RAD {surface.radius:.17g} {textures[0]}"]
    if isinstance(surface, Level):
        return [f"PLANE CENTER {numbers(surface.point)} NORMAL {numbers(surface.normal)} {textures[0]}"]
    corners = surface.corners.reshape(-1, 9).tolist()
    form = "TRI V0 %.17g %.17g %.17g V1 %.17g %.17g %.17g V2 %.17g %.17g %.17g "
    return [form % tuple(row) + texture for row, texture in zip(corners, textures, strict=True)]


# Which surfaces the eye may see from behind: Tachyon turns every normal towards the viewer.


def from_behind(surface: Surface, eye: np.ndarray) -> np.ndarray:
    """Return whether the eye [m] is behind each facet, or the one surface; shape (facets,) or (1,)."""
    if isinstance(surface, Ball):
        return np.array([np.linalg.norm(eye - surface.center) < surface.radius])
    if isinstance(surface, Level):
        return np.array([surface.normal @ (eye - surface.point) <= 0])
    first = surface.corners[:, 0]
    normals = np.cross(surface.corners[:, 1] - first, surface.corners[:, 2] - first)
    return np.einsum("ij,ij->i", normals, eye - first) <= 0


def one_sided_from_behind(scene: Scene) -> str | None:
    """Return the first one-sided shape whose back the eye may see, in words, or None."""
    eye = np.asarray(scene.camera.eye, dtype=np.float64)
    for index, shape in enumerate(scene.shapes):
        if not shape.two_sided and _shows_its_back(shape, eye):
            return f"shapes[{index}]"
    return None


def _shows_its_back(shape: Shape, eye: np.ndarray) -> bool:
    surface = surface_of(shape)
    behind = from_behind(surface, eye)
    if not behind.any():
        return False
    # What is closed hides its back from an eye outside.
    return not (isinstance(surface, Facets) and _closed(surface) and abs(_winding(surface, eye)) < 0.5)


def _closed(facets: Facets) -> bool:
    """Return whether every directed edge has its reverse, as often."""
    start = facets.corners.reshape(-1, 3)
    end = np.roll(facets.corners, -1, axis=1).reshape(-1, 3)
    forth, back = (edges[np.lexsort(edges.T)] for edges in (np.hstack([start, end]), np.hstack([end, start])))
    return np.array_equal(forth, back)


def _winding(facets: Facets, eye: np.ndarray) -> float:
    """Return how often the facets wind around the eye, by their solid angles (Van Oosterom and Strackee, 1983)."""
    a, b, c = np.moveaxis(facets.corners - eye, 1, 0)
    x, y, z = (np.linalg.norm(side, axis=1) for side in (a, b, c))
    over = np.einsum("ij,ij->i", a, np.cross(b, c))
    dots = [np.einsum("ij,ij->i", left, right) for left, right in ((a, b), (b, c), (c, a))]
    under = x * y * z + dots[0] * z + dots[1] * x + dots[2] * y
    return float(np.arctan2(over, under).sum() / (2 * np.pi))
