"""`shrink`: the search, and the steps that remove pixels, shapes, lights and faces."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from rayproof.cases.placement import compose, matrix, translation, vector
from rayproof.cases.scene import Cube, Mesh, Scene, Shape, Square, Triangle
from rayproof.cases.stages import Stage
from rayproof.reports.shrinking.attempts import Search, SearchLimits, SpentError, Step
from rayproof.reports.shrinking.failure import Renderer, failure
from rayproof.reports.shrinking.numbers import STEPS as PLAINER

# Sizes of the whole view. A single pixel in the middle cannot show errors of rows, columns or the aspect ratio.
VIEWS = ((1, 1), (2, 1), (1, 2), (2, 2), (3, 2), (4, 3), (8, 6), (16, 12), (32, 24))
WINDOWS = (3, 5, 7, 15, 31)  # px, sides of windows around the worst pixel
UNLIT = tuple(stage for stage in Stage if list(Stage).index(stage) < list(Stage).index(Stage.VISIBILITY))


class NothingFailsError(ValueError):
    """The subject agrees with the oracle in the scene."""


def shrink(
    scene: Scene,
    render: Renderer,
    *,
    stage: Stage | None = None,
    limits: SearchLimits | None = None,
    progress: Callable[[Search], None] = lambda search: None,
) -> Search:
    """Search for the smallest scene with the same failure, and return the finished search.

    The steps are repeated until none finds a smaller scene. Ctrl-C ends the search with the smallest scene so far.

    Raises:
        NothingFailsError: the scene has no failure, or none at `stage`.

    """
    first = failure(scene, render, stage)
    if first is None:
        raise NothingFailsError(f"nothing fails{'' if stage is None else f' at {stage}'} before the oracle alone")
    search = Search(scene=scene, failure=first, render=render, limits=limits or SearchLimits(), progress=progress)
    try:
        before = None
        while before is not search.scene:
            before = search.scene
            for step in STEPS:
                step(search)
    except SpentError:
        pass
    except KeyboardInterrupt:
        search.interrupted = True
    return search


def fewer_pixels(search: Search) -> None:
    """Reduce the image to a single failing pixel, to the whole view with fewer pixels, or to a window of it."""
    scene, failure = search.scene, search.failure
    camera = scene.camera
    if camera.width * camera.height == 1:
        return
    around = [partial(aimed, scene, failure.truth[Stage.RAY], pixel, 1) for pixel in failure.pixels]
    worst = (failure.pixels or ((camera.width // 2, camera.height // 2),))[0]
    windows = [(n * n, partial(aimed, scene, failure.truth[Stage.RAY], worst, n)) for n in WINDOWS]
    views = [(w * h, partial(viewed, scene, w, h)) for w, h in VIEWS]
    others = [build for _, build in sorted([*views, *windows], key=lambda pair: pair[0])]
    search.first([*around, *others])


def aimed(scene: Scene, rays: np.ndarray, pixel: tuple[int, int], side: int) -> Scene:
    """Return the scene with a window of side x side pixels, whose middle is the centre of `pixel` (column, row)."""
    camera, (column, row) = scene.camera, pixel
    direction = np.asarray(rays[row, column], dtype=np.float64)
    reach = math.dist(camera.eye, camera.target)
    # The pixels keep their size in the middle of the image.
    fovy = 2 * math.degrees(math.atan(math.tan(camera.alpha) * side / camera.height))
    target = vector(np.asarray(camera.eye) + reach * direction)
    return replace(scene, camera=replace(camera, target=target, fovy=fovy, width=side, height=side))


def viewed(scene: Scene, width: int, height: int) -> Scene:
    """Return the scene with the whole view in width x height pixels."""
    return replace(scene, camera=replace(scene.camera, width=width, height=height))


def fewer_shapes(search: Search) -> None:
    """Keep only the visible shapes at the failing pixel, or none; otherwise remove halves, quarters, single shapes."""
    if not search.scene.shapes:
        return
    visible = {shape for shape, _ in search.failure.seen()}
    scene = search.scene
    kept = [set(), visible] if search.failure.stage in (Stage.CAMERA, Stage.RAY) else [visible]
    if search.failure.stage not in UNLIT:
        kept += [visible | {blocker} for blocker in range(len(scene.shapes))] if len(scene.shapes) <= 12 else []
    if not search.first([partial(_with_shapes, scene, sorted(indices)) for indices in kept]):
        _without(search, lambda now: now.shapes, lambda now, left: replace(now, shapes=tuple(left)))


def _with_shapes(scene: Scene, indices: Sequence[int]) -> Scene:
    return replace(scene, shapes=tuple(scene.shapes[index] for index in indices if index < len(scene.shapes)))


def fewer_lights(search: Search) -> None:
    """Keep a single light, or none; otherwise remove halves, quarters, single lights."""
    scene = search.scene
    kept = [()] if search.failure.stage in UNLIT else [(light,) for light in scene.lights]
    if not search.first([partial(replace, scene, lights=lights) for lights in kept]):
        _without(search, lambda now: now.lights, lambda now, left: replace(now, lights=tuple(left)))


def _without(
    search: Search, parts: Callable[[Scene], Sequence[Any]], build: Callable[[Scene, list[Any]], Scene]
) -> None:
    """Remove runs of parts, long ones first, as long as the failure stays the same (Zeller and Hildebrandt, 2002)."""
    length = len(parts(search.scene)) // 2
    while length:
        start = 0
        while start < len(now := parts(search.scene)):
            left = [*now[:start], *now[start + length :]]
            # After a removal, the next run begins at the same index.
            start += 0 if search.attempt(partial(build, search.scene, left)) else length
        length //= 2


def fewer_faces(search: Search) -> None:
    """Replace a mesh by its visible face, a triangle, or else halve it; replace a cube by its visible square."""
    for index in range(len(search.scene.shapes)):
        shape, visible = search.scene.shapes[index], sorted(search.failure.seen())
        faces = [face for owner, face in visible if owner == index and face >= 0]
        if isinstance(shape, Mesh):
            builds = [partial(_placed, search.scene, index, _triangle(shape, face)) for face in faces[:2]]
            builds += [partial(_placed, search.scene, index, _thinned(shape, faces))] if faces else []
            if not search.first(builds) and len(shape.faces) > 1:
                _thin(search, index)
            now = search.scene.shapes[index]
            if isinstance(now, Mesh) and len(now.faces) == 1:
                search.attempt(partial(_placed, search.scene, index, _triangle(now, 0)))
        elif isinstance(shape, Cube) and len(search.failure.pixels) == 1:
            normals = search.failure.truth[Stage.NORMAL]
            column, row = search.failure.pixels[0]
            local = np.asarray(shape.to_world)[:3, :3].T @ normals[row, column]
            search.attempt(partial(_placed, search.scene, index, _side(shape, local)))


def _placed(scene: Scene, index: int, shape: Shape) -> Scene:
    return replace(scene, shapes=(*scene.shapes[:index], shape, *scene.shapes[index + 1 :]))


def _triangle(mesh: Mesh, face: int) -> Triangle:
    first, second, third = (vector(corner) for corner in mesh.vertices[mesh.faces[face]])
    return Triangle(
        albedo=mesh.albedo, to_world=mesh.to_world, two_sided=mesh.two_sided, vertices=(first, second, third)
    )


def _thinned(mesh: Mesh, faces: Sequence[int]) -> Mesh:
    """Return a mesh with only the named faces, without unused vertices."""
    chosen = mesh.faces[list(faces)]
    kept, numbers = np.unique(chosen, return_inverse=True)
    return replace(mesh, vertices=mesh.vertices[kept], faces=numbers.reshape(chosen.shape), file=None)


def _thin(search: Search, index: int) -> None:
    def faces(scene: Scene) -> list[int]:
        mesh = scene.shapes[index]
        return list(range(len(mesh.faces))) if isinstance(mesh, Mesh) else []

    def build(scene: Scene, left: list[int]) -> Scene:
        mesh = scene.shapes[index]
        assert isinstance(mesh, Mesh)
        return _placed(scene, index, _thinned(mesh, left))

    _without(search, faces, build)


def _side(cube: Cube, normal: np.ndarray) -> Square:
    """Return the side of a cube as a square, chosen by its outward normal in object space, closest to `normal` (3,)."""
    axis = int(np.argmax(np.abs(normal)))
    towards = 1.0 if normal[axis] >= 0 else -1.0
    turned = np.eye(4)
    turned[:3, 2] = np.eye(3)[axis] * towards
    turned[:3, 0], turned[:3, 1] = np.eye(3)[(axis + 1) % 3], np.eye(3)[(axis + 2) % 3] * towards
    place = compose(cube.to_world, matrix(turned), translation(0, 0, 0.5))
    return Square(albedo=cube.albedo, to_world=place, two_sided=cube.two_sided)


STEPS: tuple[Step, ...] = (fewer_pixels, fewer_shapes, fewer_lights, fewer_faces, *PLAINER)
