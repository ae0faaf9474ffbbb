"""What a law of light says of two or more images of one renderer, as plain data: nobody else's image is asked for.

A law asks a renderer for the image of a scene and of scenes that it changes in a known way, and yields relations: what
each stage of the changed scene must be (`expected`, made from the first image) and what it is (`measured`). Both come
from the one under test, so that the law holds for any renderer, and only rounding may keep the two apart.
Source: Chen, Cheung and Yiu, Metamorphic Testing: A New Approach for Generating Next Test Cases (1998).
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

import numpy as np

from cases.answers import Answers
from cases.scene import IDENTITY, Camera, Matrix, Mesh, PointLight, Rgb, Scene, Shape, Triangle, Vector
from cases.stages import IMAGE_STAGES, Stage

LIGHT = (Stage.IRRADIANCE, Stage.EXITANCE, Stage.RADIANCE)
GEOMETRY = (Stage.RAY, Stage.OBJECT, Stage.DISTANCE, Stage.POSITION, Stage.NORMAL)
Map = Callable[[np.ndarray], np.ndarray]
Maps = Mapping[Stage, Map]


class Ask(Protocol):
    """The renderer that a law is put to."""

    def __call__(self, scene: Scene) -> Answers:
        """Return every stage that it answers of `scene` and that is to be looked at; radiance alone, it may be."""
        ...


@dataclass(frozen=True, kw_only=True)
class Conditions:
    """What a law knows of its own conditioning, in multiples of what the scenes themselves explain."""

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
    one, other = ask(scene), ask(changed)
    for stage in stages:
        if stage in one and stage in other:
            expected = (before or {}).get(stage, _itself)(one[stage])
            measured = (after or {}).get(stage, _itself)(other[stage])
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
        if stage in together and all(stage in one for one in several):
            terms = [share * one[stage] for share, one in zip(shares, several, strict=True)]
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


# ---------------------------------------------------------------------------------------------------- changed scenes


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
