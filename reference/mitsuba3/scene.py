"""A scene as Mitsuba's dictionary: shapes, instances, planes as discs, sensor, one light, ray offsets.

Mitsuba 3.9.1 only warns of a sheared or unevenly scaled `sphere` and then draws something else; it turns the normals
of a mirrored `sphere` inwards, and the geometric normals of a mirrored `cube` or `rectangle` against their shading
normals. Under an `instance` all of them are right. It has no plane: one is a disc here and not a square, because its
`rectangle` is two triangles whose hit points carry the rounding of their corners (3 cm off for half a width of 1000
km), while its `disk` is intersected in its own plane and keeps its digits at any size.
Source of the epsilons: Mitsuba 3.9.1, core/math.h and render/interaction.h (`offset_p`, `spawn_ray_to`).
"""

import itertools
import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from rayproof.cases.placement import placed, world_triangles
from rayproof.cases.scene import (
    Camera,
    Cube,
    Mesh,
    Plane,
    PointLight,
    Scene,
    Shape,
    Sphere,
    Square,
    Triangle,
    is_similarity,
)

# 1500 times the unit roundoff of float32.
RAY_EPSILON = 1500 * 2.0**-24
# A shadow ray ends this fraction of its length short of the light: blockers nearer to the light do not count.
SHADOW_EPSILON = 10 * RAY_EPSILON


def offsets(positions: np.ndarray) -> np.ndarray:
    """Return the height [m] of a shadow ray's start above each position (..., 3): lower blockers do not count."""
    return RAY_EPSILON * (1.0 + np.abs(positions).max(axis=-1))


CUBE_CORNERS = np.array(list(itertools.product((-0.5, 0.5), repeat=3)))
SQUARE_CORNERS = CUBE_CORNERS[::2] * (1.0, 1.0, 0.0)


@lru_cache(maxsize=256)
def box(shape: Shape) -> tuple[np.ndarray, np.ndarray]:
    """Return the lowest and highest world coordinates [m] of a finite shape, (3,) each.

    Raises:
        TypeError: the shape is infinite.

    """
    if isinstance(shape, Triangle | Mesh):
        corners = world_triangles(shape).reshape(-1, 3).astype(np.float64)
        return corners.min(axis=0), corners.max(axis=0)
    linear, translation = placed(shape)
    if isinstance(shape, Sphere):
        center = linear @ shape.center + translation
        # The extent of the transformed unit ball along an axis is the length of that row of the linear map.
        reach = shape.radius * np.linalg.norm(linear, axis=1)
        return center - reach, center + reach
    if isinstance(shape, Cube | Square):
        corners = (CUBE_CORNERS if isinstance(shape, Cube) else SQUARE_CORNERS) @ linear.T + translation
        return corners.min(axis=0), corners.max(axis=0)
    raise TypeError(f"{type(shape).__name__} has no box")


def finite_shapes(scene: Scene) -> list[tuple[int, Shape]]:
    """Return the shapes that have a box, each with its index in the scene."""
    return [(index, shape) for index, shape in enumerate(scene.shapes) if not isinstance(shape, Plane)]


def distances_from(eye: tuple[float, float, float], shape: Shape) -> tuple[float, float]:
    """Return bounds [m] on how near and how far from `eye` the points of a finite shape lie."""
    low, high = box(shape)
    nearest = np.linalg.norm(np.maximum(0.0, np.maximum(low - eye, eye - high)))
    farthest = np.linalg.norm(np.maximum(np.abs(low - eye), np.abs(high - eye)))
    return float(nearest), float(farthest)


def farthest_visible(camera: Camera) -> float:
    """Return the distance [m] from the eye to the far plane's corners."""
    vertical = math.tan(camera.alpha)
    return camera.far * math.hypot(1.0, vertical, vertical * camera.aspect)


# The disc is a thousandth larger than the area that it must cover, so that no ray passes near its rim.
MARGIN = 1.001
# Without a far plane nothing bounds the view: the disc then reaches this many times farther than the scene's own
# lengths, so that only rays within a millionth of a radian of the horizon pass it by.
HORIZON = 1e6


def disc_reach(scene: Scene) -> float:
    """Return the radius [m] around the eye within which every plane must be present.

    Shadow rays run between points that the camera sees and lights, so a ball about the eye that contains both contains
    every crossing of a shadow ray with the plane too.
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
    radius = disc_reach(scene)
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


def needs_instance(shape: Shape) -> bool:
    """Return whether Mitsuba gets the shape right only as an instance."""
    linear = np.asarray(shape.to_world, dtype=np.float64)[:3, :3]
    return bool(np.linalg.det(linear) < 0) or (isinstance(shape, Sphere) and not is_similarity(shape.to_world))


@lru_cache(maxsize=64)
def kept_faces(shape: Triangle | Mesh) -> np.ndarray:
    """Return the indices of the triangles that have an area: Embree may report hits of the others."""
    corners = world_triangles(shape).astype(np.float64)
    doubled_area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return np.flatnonzero(np.any(doubled_area != 0, axis=1))


def entries(mi: Any, scene: Scene) -> dict[str, Any]:
    """Return the shapes as entries of Mitsuba's scene dictionary; shape n is called `shape-n`.

    A mesh without area is left out.
    """
    described: dict[str, Any] = {}
    for index, shape in enumerate(scene.shapes):
        name = f"shape-{index}"
        if isinstance(shape, Triangle | Mesh):
            if len(kept_faces(shape)):
                described[name] = _mesh(mi, shape, name)
        elif isinstance(shape, Plane):
            to_world = _transform(mi, disc_to_world(shape, scene))
            described[name] = {"type": "disk", "to_world": to_world, "bsdf": _bsdf(shape)}
        elif needs_instance(shape):
            within, around = split_scale(shape)
            described[f"group-{index}"] = {"type": "shapegroup", "shape": _primitive(mi, shape, within)}
            group = {"type": "ref", "id": f"group-{index}"}
            described[name] = {"type": "instance", "group": group, "to_world": _transform(mi, around)}
        else:
            described[name] = _primitive(mi, shape, np.asarray(shape.to_world))
    return described


def split_scale(shape: Shape) -> tuple[np.ndarray, np.ndarray]:
    """Return two 4x4 matrices whose product is `to_world`: a uniform scale within the group, the rest around it.

    Mitsuba takes a ray to where it passes a sphere before it solves for the hits, by a distance that is right only for
    unit directions and ever farther beyond for longer ones. With the smallest stretch moved into the group no direction
    in it is longer than one; without, the LLVM variant's normals on a flat ellipsoid are off by a degree.
    """
    to_world = np.asarray(shape.to_world, dtype=np.float64)
    smallest = np.linalg.svd(to_world[:3, :3], compute_uv=False)[2]
    return np.diag([smallest, smallest, smallest, 1.0]), to_world @ np.diag([1 / smallest] * 3 + [1.0])


def _primitive(mi: Any, shape: Shape, to_world: np.ndarray) -> dict[str, Any]:
    bsdf = _bsdf(shape)
    if isinstance(shape, Sphere):
        center, radius = list(shape.center), shape.radius
        return {
            "type": "sphere",
            "center": center,
            "radius": radius,
            "to_world": _transform(mi, to_world),
            "bsdf": bsdf,
        }
    # Mitsuba's cube and rectangle reach from -1 to 1.
    halved = np.asarray(to_world, dtype=np.float64) @ np.diag([0.5, 0.5, 0.5, 1.0])
    if isinstance(shape, Cube):
        return {"type": "cube", "to_world": _transform(mi, halved), "bsdf": bsdf}
    if isinstance(shape, Square):
        return {"type": "rectangle", "to_world": _transform(mi, halved), "bsdf": bsdf}
    raise LookupError(f"Mitsuba has not been taught the shape {type(shape).__name__}")


def _mesh(mi: Any, shape: Triangle | Mesh, name: str) -> Any:
    corners = world_triangles(shape)[kept_faces(shape)]
    properties = mi.Properties()
    properties.set_id(name)
    properties["face_normals"] = True
    properties["bsdf"] = mi.load_dict(_bsdf(shape))
    mesh = mi.Mesh(name, vertex_count=3 * len(corners), face_count=len(corners), props=properties)
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = corners.ravel()
    parameters["faces"] = np.arange(3 * len(corners), dtype=np.uint32)
    parameters.update()
    return mesh


def _bsdf(shape: Shape) -> dict[str, Any]:
    # Mitsuba refuses an albedo above 1; the answers that depend on it are declared unsupported.
    reflectance = {"type": "rgb", "value": [min(channel, 1.0) for channel in shape.albedo]}
    diffuse = {"type": "diffuse", "reflectance": reflectance}
    return {"type": "twosided", "side": diffuse} if shape.two_sided else diffuse


def _transform(mi: Any, matrix: Any) -> Any:
    return mi.ScalarTransform4f(np.asarray(matrix, dtype=np.float64))


@dataclass(frozen=True, kw_only=True)
class MitsubaScene:
    """A scene as Mitsuba has it."""

    mi: Any  # the module, in the variant that made `loaded`
    loaded: Any  # mi.Scene
    # Mitsuba orders shapes as it likes and differently per variant; this undoes it.
    indices: dict[Any, int]  # mi.Shape -> index into the scene's shapes
    faces: dict[int, np.ndarray]  # shape index of a mesh -> our face index of each of its triangles

    @property
    def sensor(self) -> Any:
        """Return the camera."""
        return self.loaded.sensors()[0]

    @property
    def emitter(self) -> Any:
        """Return the light that is in place."""
        return self.loaded.emitters()[0]

    def place(self, light: PointLight) -> None:
        """Put `light` in the place of the one before."""
        parameters = self.mi.traverse(self.loaded)
        parameters["light.position"] = self.mi.Point3f(*light.position)
        parameters["light.intensity.value"] = self.mi.Color3f(*intensity(light))
        parameters.update()


def intensity(light: PointLight) -> list[float]:
    """Return the radiant intensity [W/sr] of an isotropic light."""
    return [channel / (4 * np.pi) for channel in light.flux]


def load_scene(mi: Any, scene: Scene, *, near: float, far: float, samples: int = 1) -> MitsubaScene:
    """Return the scene as Mitsuba's, with near and far plane at the given depths [m] and the first light, if any.

    `direct` picks one of several lights at random for each sample, so each scene has at most one: see `World.place`.
    """
    description: dict[str, Any] = {
        "type": "scene",
        "embree_use_robust_intersections": True,
        # No samples towards light sources that a random direction could hit: a point light never is.
        "integrator": {"type": "direct", "emitter_samples": 1, "bsdf_samples": 0},
        "sensor": sensor(mi, scene.camera, near, far, samples),
        **entries(mi, scene),
    }
    if scene.lights:
        first = scene.lights[0]
        color = {"type": "rgb", "value": intensity(first)}
        description["light"] = {"type": "point", "position": list(first.position), "intensity": color}
    # Optimising would merge meshes that share a material into one, and their indices with them. Loading in parallel
    # would number the shapes by chance, and every new order is a new kernel to compile.
    loaded = mi.load_dict(description, parallel=False, optimize=False)
    return MitsubaScene(
        mi=mi,
        loaded=loaded,
        indices={shape: int(shape.id().removeprefix("shape-")) for shape in loaded.shapes()},
        faces={i: kept_faces(shape) for i, shape in enumerate(scene.shapes) if isinstance(shape, Triangle | Mesh)},
    )


def sensor(mi: Any, camera: Camera, near: float, far: float, samples: int) -> dict[str, Any]:
    """Return the camera as an entry of Mitsuba's scene dictionary, with a box-filtered film."""
    return {
        "type": "perspective",
        "fov": camera.fovy,
        "fov_axis": "y",
        "near_clip": near,
        "far_clip": far,
        "to_world": mi.ScalarTransform4f().look_at(
            origin=list(camera.eye), target=list(camera.target), up=list(camera.up)
        ),
        "film": {
            "type": "hdrfilm",
            "width": camera.width,
            "height": camera.height,
            "pixel_format": "rgb",
            "component_format": "float32",
            "rfilter": {"type": "box"},
        },
        # Unjittered strata: one sample is the pixel's centre, n x n are the centres of n x n parts.
        "sampler": {"type": "stratified", "sample_count": samples * samples, "jitter": False},
    }
