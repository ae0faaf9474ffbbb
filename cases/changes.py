"""Scenes changed in known ways, for laws: moved, lit otherwise, their shapes described otherwise."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from rayproof.cases.relations import Map
from rayproof.cases.scene import (
    IDENTITY,
    Camera,
    Cube,
    Matrix,
    Mesh,
    PointLight,
    Rgb,
    Scene,
    Shape,
    Sphere,
    Triangle,
    Vector,
)
from rayproof.cases.stages import Stage

BLACK: Rgb = (0.0, 0.0, 0.0)


def vector(values: Any) -> Vector:
    """Return three numbers as a tuple of Python's own."""
    x, y, z = map(float, values)
    return x, y, z


def matrix(values: Any) -> Matrix:
    """Return a 4x4 matrix as tuples of Python's own numbers."""
    rows = [tuple(map(float, row)) for row in np.asarray(values)]
    return tuple(rows)  # pyright: ignore[reportReturnType]


def placed(shape: Shape, motion: Any) -> Shape:
    """Return the shape with a motion of its object space put before its own placement."""
    return replace(shape, to_world=matrix(np.asarray(shape.to_world) @ np.asarray(motion)))


def with_camera(scene: Scene, **members: Any) -> Scene:
    """Return the scene seen by a changed camera."""
    return replace(scene, camera=replace(scene.camera, **members))


def with_lights(scene: Scene, *lights: PointLight) -> Scene:
    """Return the scene with other lights."""
    return replace(scene, lights=lights)


def with_shapes(scene: Scene, change: Callable[[Shape], Shape]) -> Scene:
    """Return the scene with each shape changed."""
    return replace(scene, shapes=tuple(map(change, scene.shapes)))


def times(colour: Rgb, factor: float) -> Rgb:
    """Return a flux or an albedo times a number."""
    return vector(np.asarray(colour) * factor)


def has_triangles(scene: Scene) -> bool:
    """Say whether any shape's corners are baked to float32."""
    return any(isinstance(shape, Triangle | Mesh) for shape in scene.shapes)


def moved_triangles(scene: Scene) -> bool:
    """Say whether any triangles stand elsewhere than they are described."""
    return any(isinstance(shape, Triangle | Mesh) and shape.to_world != IDENTITY for shape in scene.shapes)


@dataclass(frozen=True, kw_only=True)
class View:
    """A camera's axes, from its eye: unit vectors [1], and the distance of its target [m]."""

    eye: np.ndarray
    forward: np.ndarray
    right: np.ndarray
    up: np.ndarray
    distance: float


def view(camera: Camera) -> View:
    """Return the axes of a camera (specification, CAM-1)."""
    eye = np.asarray(camera.eye)
    ahead = np.asarray(camera.target) - eye
    distance = float(np.linalg.norm(ahead))
    forward = ahead / distance
    across = np.cross(forward, np.asarray(camera.up))
    right = across / np.linalg.norm(across)
    return View(eye=eye, forward=forward, right=right, up=np.cross(right, forward), distance=distance)


def moved(scene: Scene, motion: Any, *, scale: float = 1.0) -> Scene:
    """Return the whole scene moved by a matrix: camera, shapes and lights; `scale` is its factor of lengths.

    Light is spread over scale^2 of the area, so that flux grows by as much (except for the lecture's simplified light).
    """
    whole = np.asarray(motion, dtype=np.float64)

    def carried(point: Vector) -> Vector:
        return vector(whole[:3, :3] @ np.asarray(point) + whole[:3, 3])

    camera, brighter = scene.camera, 1.0 if scene.shading == "simplified" else scale * scale
    return replace(
        scene,
        camera=replace(
            camera,
            eye=carried(camera.eye),
            target=carried(camera.target),
            up=vector(whole[:3, :3] @ np.asarray(camera.up)),
            near=camera.near * scale,
            far=camera.far * scale,
        ),
        shapes=tuple(replace(shape, to_world=matrix(whole @ np.asarray(shape.to_world))) for shape in scene.shapes),
        lights=tuple(
            replace(light, position=carried(light.position), flux=times(light.flux, brighter)) for light in scene.lights
        ),
    )


def carried_by(motion: Any, *, scale: float = 1.0) -> dict[Stage, Map]:
    """Return what a motion of the whole scene does to each stage's image."""
    whole = np.asarray(motion, dtype=np.float64)
    turn, shift = whole[:3, :3] / scale, whole[:3, 3]

    def turned(image: np.ndarray) -> np.ndarray:
        return image @ turn.T

    def points(image: np.ndarray) -> np.ndarray:
        there = image @ whole[:3, :3].T + shift
        return np.where(np.any(image != 0, axis=-1, keepdims=True), there, 0.0)

    return {
        Stage.RAY: turned,
        Stage.NORMAL: turned,
        Stage.POSITION: points,
        Stage.DISTANCE: lambda image: image * scale,
    }


def behind_the_eye(scene: Scene, share: float) -> np.ndarray:
    """Return the place [m] behind the eye at a share of the target's distance."""
    axes = view(scene.camera)
    return axes.eye - share * axes.distance * axes.forward


def strong(scene: Scene) -> tuple[float, float, float]:
    """Return a flux [W] that lights the target well from about the eye."""
    flux = 50.0 * view(scene.camera).distance ** 2
    return flux, 1.1 * flux, 0.9 * flux


def around(scene: Scene, place: np.ndarray, size: float, kind: type[Shape]) -> Shape:
    """Return a black, closed shape of half-width `size` [m] about a place, turned as the camera is."""
    axes = view(scene.camera)
    pose = np.eye(4)
    pose[:3, :3] = np.stack([axes.right, axes.up, -axes.forward], axis=1) * (size if kind is Sphere else 2 * size)
    pose[:3, 3] = place
    return kind(albedo=BLACK, to_world=matrix(pose))


def switched_on(scene: Scene, place: np.ndarray, *walls: Shape) -> tuple[Scene, Scene]:
    """Return the scene with walls, and the same with a strong light at `place` as well."""
    dark = replace(scene, shapes=(*scene.shapes, *walls))
    return dark, with_lights(dark, *dark.lights, PointLight(position=vector(place), flux=strong(scene)))


def at_least_two(scene: Scene) -> Scene:
    """Return the scene with a second light beside its camera, if it has but one."""
    if len(scene.lights) != 1:
        return scene
    axes = view(scene.camera)
    (first,) = scene.lights
    place = axes.eye + axes.distance * (0.3 * axes.right + 0.2 * axes.up)
    return with_lights(scene, first, PointLight(position=vector(place), flux=vector(first.flux[::-1])))


def lit_from_the_eye(scene: Scene) -> Scene:
    """Return the scene with one light beside the eye, a little in front of it."""
    axes = view(scene.camera)
    place = axes.eye + axes.distance * (0.05 * axes.right + 0.03 * axes.up + 0.001 * axes.forward)
    flux = 40.0 * axes.distance**2
    return with_lights(scene, PointLight(position=vector(place), flux=(flux, 0.8 * flux, 1.2 * flux)))


def rewound(shape: Shape) -> Shape:
    """Return triangles and meshes wound the other way."""
    if isinstance(shape, Mesh):
        return replace(shape, faces=shape.faces[:, [0, 2, 1]])
    if isinstance(shape, Triangle):
        a, b, c = shape.vertices
        return replace(shape, vertices=(a, c, b))
    return shape


CLOSE = 1e-5  # of plane equations: far more than rounding leaves between two that are one


def planes(shape: Shape) -> np.ndarray:
    """Return the planes (n, 4) that hold a shape's flat sides: unit normals, turned to one side, and offsets [m]."""
    if isinstance(shape, Sphere | Mesh | Triangle):
        return np.zeros((0, 4))
    local = np.array([(0.0, 0.0, 1.0, 0.0)])
    if isinstance(shape, Cube):
        local = np.array([(*axis, half) for axis in np.eye(3) for half in (-0.5, 0.5)])
    found = local @ np.linalg.inv(np.asarray(shape.to_world))
    found /= np.linalg.norm(found[:, :3], axis=1, keepdims=True)
    first = np.take_along_axis(found, np.argmax(np.abs(found[:, :3]) > 0.5, axis=1)[:, np.newaxis], axis=1)
    return found * np.sign(first)


def coincide(scene: Scene) -> bool:
    """Say whether flat sides of two shapes lie in one plane, where either may be the nearest."""
    sides = [planes(shape) for shape in scene.shapes]
    return any(
        np.abs(one[:, np.newaxis] - other[np.newaxis]).max(axis=-1).min(initial=1.0) < CLOSE
        for index, one in enumerate(sides)
        for other in sides[:index]
    )
