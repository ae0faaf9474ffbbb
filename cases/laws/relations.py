"""`Relation` and `Ask`, of which laws are made, and changes of scenes that several laws use (moved, relit, rewound).

A law asks a renderer for the image of a scene and of scenes that it changes in a known way, and yields relations: what
each stage of the changed scene must be (`expected`, made from the first image) and what it is (`measured`). Both come
from the one under test, so that the law holds for any renderer, and only rounding may keep the two apart.
Source: Chen, Cheung and Yiu, Metamorphic Testing: A New Approach for Generating Next Test Cases (1998).
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

import numpy as np

from rayproof.cases.placement import matrix, vector
from rayproof.cases.scene import (
    IDENTITY,
    Camera,
    Cube,
    Mesh,
    PointLight,
    Rgb,
    Scene,
    Shape,
    Sphere,
    Triangle,
    Vector,
)
from rayproof.cases.stages import IMAGE_STAGES, Stage, StageImages

LIGHT = (Stage.IRRADIANCE, Stage.EXITANCE, Stage.RADIANCE)
GEOMETRY = (Stage.RAY, Stage.OBJECT, Stage.DISTANCE, Stage.POSITION, Stage.NORMAL)
Map = Callable[[np.ndarray], np.ndarray]
Maps = Mapping[Stage, Map]


class Ask(Protocol):
    """The renderer that a law is put to."""

    def __call__(self, scene: Scene) -> StageImages:
        """Return every stage that it answers of `scene` and that is to be looked at; radiance alone, it may be."""
        ...


@dataclass(frozen=True, kw_only=True)
class Conditions:
    """A law's own conditioning, in multiples of that of the scenes themselves."""

    factor: float = 1.0  # times which the law magnifies rounding
    truncation: float = 0.0  # relative: what a finite sum leaves out
    rebaked: bool = False  # it moves or divides triangles, whose corners are then rounded to float32 anew
    exact: bool = False  # only powers of two were touched, or nothing at all: equal to the last bit


@dataclass(frozen=True, kw_only=True, eq=False)
class Relation:
    """One stage of a changed scene: what a law expects, from the same renderer's other images, and what was measured.

    Images (height, width, channels) in the stage's unit; those of `Stage.CAMERA` are lists of numbers in that shape.
    """

    stage: Stage
    expected: np.ndarray
    measured: np.ndarray
    scene: Scene  # the one whose image `expected` was made from
    changed: Scene  # the one that `measured` is an image of
    what: str  # the change, in words
    terms: np.ndarray | None = None  # sum of the sizes of what `expected` was added up from, where that is larger
    examined: np.ndarray | None = None  # (height, width) bool: pixels that the law speaks of; None: all
    conditions: Conditions = field(default_factory=Conditions)


def related(
    ask: Ask,
    scene: Scene,
    changed: Scene,
    *,
    what: str,
    before: Maps | None = None,
    after: Maps | None = None,
    stages: tuple[Stage, ...] = IMAGE_STAGES,
    conditions: Conditions | None = None,
    examined: np.ndarray | None = None,
) -> Iterator[Relation]:
    """Yield, for each of `stages` that the renderer answers, the relation of two scenes' images.

    `before` maps the images of `scene` to what the law expects, `after` those of `changed` to what is comparable with
    it; a stage that neither names is compared as it is.
    """
    images, changed_images = ask(scene), ask(changed)
    for stage in stages:
        if stage in images and stage in changed_images:
            expected = (before or {}).get(stage, _itself)(images[stage])
            measured = (after or {}).get(stage, _itself)(changed_images[stage])
            yield Relation(
                stage=stage,
                expected=expected,
                measured=measured,
                scene=scene,
                changed=changed,
                what=what,
                examined=examined,
                conditions=conditions or Conditions(),
            )


def _itself(image: np.ndarray) -> np.ndarray:
    return image


def added(
    ask: Ask, parts: tuple[Scene, ...], whole: Scene, *, what: str, weights: tuple[float, ...] = ()
) -> Iterator[Relation]:
    """Yield for each stage of light that the image of `whole` is the (weighted) sum of the images of `parts`."""
    several, together = [ask(part) for part in parts], ask(whole)
    shares = weights or (1.0,) * len(parts)
    for stage in LIGHT:
        if stage in together and all(stage in images for images in several):
            terms = [share * images[stage] for share, images in zip(shares, several, strict=True)]
            yield Relation(
                stage=stage,
                expected=np.sum(terms, axis=0),
                measured=together[stage],
                scene=parts[0],
                changed=whole,
                what=what,
                terms=np.sum(np.abs(terms), axis=0),
            )


def everywhere(turn: Map) -> dict[Stage, Map]:
    """Return maps that do the same to every image stage."""
    return dict.fromkeys(IMAGE_STAGES, turn)


def faces(change: Map) -> dict[Stage, Map]:
    """Return the map of the object stage that changes its face indices."""

    def renumbered(image: np.ndarray) -> np.ndarray:
        return np.stack([image[..., 0], change(image[..., 1])], axis=-1)

    return {Stage.OBJECT: renumbered}


# Scenes changed in known ways: moved, lit otherwise, their shapes described otherwise.
BLACK: Rgb = (0.0, 0.0, 0.0)


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
class CameraAxes:
    """A camera's axes, from its eye: unit vectors [1], and the distance of its target [m]."""

    eye: np.ndarray
    forward: np.ndarray
    right: np.ndarray
    up: np.ndarray
    distance: float


def camera_axes(camera: Camera) -> CameraAxes:
    """Return the axes of a camera (specification, CAM-1)."""
    eye = np.asarray(camera.eye)
    ahead = np.asarray(camera.target) - eye
    distance = float(np.linalg.norm(ahead))
    forward = ahead / distance
    across = np.cross(forward, np.asarray(camera.up))
    right = across / np.linalg.norm(across)
    return CameraAxes(eye=eye, forward=forward, right=right, up=np.cross(right, forward), distance=distance)


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
    axes = camera_axes(scene.camera)
    return axes.eye - share * axes.distance * axes.forward


def strong(scene: Scene) -> tuple[float, float, float]:
    """Return a flux [W] that lights the target well from about the eye."""
    flux = 50.0 * camera_axes(scene.camera).distance ** 2
    return flux, 1.1 * flux, 0.9 * flux


def around(scene: Scene, place: np.ndarray, size: float, kind: type[Shape]) -> Shape:
    """Return a black, closed shape of half-width `size` [m] about a place, turned as the camera is."""
    axes = camera_axes(scene.camera)
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
    axes = camera_axes(scene.camera)
    (first,) = scene.lights
    place = axes.eye + axes.distance * (0.3 * axes.right + 0.2 * axes.up)
    return with_lights(scene, first, PointLight(position=vector(place), flux=vector(first.flux[::-1])))


def lit_from_the_eye(scene: Scene) -> Scene:
    """Return the scene with one light beside the eye, a little in front of it."""
    axes = camera_axes(scene.camera)
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
    rows = local @ np.linalg.inv(np.asarray(shape.to_world))
    rows /= np.linalg.norm(rows[:, :3], axis=1, keepdims=True)
    first = np.take_along_axis(rows, np.argmax(np.abs(rows[:, :3]) > 0.5, axis=1)[:, np.newaxis], axis=1)
    return rows * np.sign(first)


def coincide(scene: Scene) -> bool:
    """Say whether flat sides of two shapes lie in one plane, where either may be the nearest."""
    sides = [planes(shape) for shape in scene.shapes]
    return any(
        np.abs(first[:, np.newaxis] - second[np.newaxis]).max(axis=-1).min(initial=1.0) < CLOSE
        for index, first in enumerate(sides)
        for second in sides[:index]
    )
