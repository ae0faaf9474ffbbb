"""Mutants of the space: a point, direction or light in object space where the formula is one of world space.

They change what no field of the scene holds, shape by shape: the rows that a stage reads, or the matrix by which an
object normal becomes a world normal (XF-1, XF-2, NRM-3).
"""

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

from rayproof.cases.scene import IDENTITY, Scene
from rayproof.cases.stages import Stage
from rayproof.reference.analytic.stages import NEXT
from rayproof.reports.audit.mutants import Mutant, Rows, Step
from rayproof.reports.audit.mutants.fields import FEELERS, LEAVING, LIGHT, NORMALS, STAGES, mutant, words
from rayproof.reports.audit.mutants.operations import LINEAR, Operation, altered, plain


def _by_shape(
    stage: Stage, use: Callable[[Scene, Rows, int], tuple[Scene, Rows]], scene: Scene, rows: Rows
) -> np.ndarray:
    """Return a stage whose scene and rows are changed shape by shape, for the pixels that show it."""
    answer = NEXT[stage](scene, rows).copy()
    for index in range(len(scene.shapes)):
        here = rows[Stage.OBJECT][:, 0] == index
        if here.any():
            answer[here] = NEXT[stage](*use(scene, {name: row[here] for name, row in rows.items()}, index))
    return answer


def _linear_and_offset(scene: Scene, index: int) -> tuple[np.ndarray, np.ndarray]:
    matrix = np.asarray(scene.shapes[index].to_world)
    return matrix[:3, :3], matrix[:3, 3]


def _to_object(scene: Scene, points: np.ndarray, index: int) -> np.ndarray:
    """Return points (n, 3) in a shape's object space."""
    linear, offset = _linear_and_offset(scene, index)
    return (points - offset) @ np.linalg.inv(linear).T


def _points_in_object_space(scene: Scene, rows: Rows, index: int) -> tuple[Scene, Rows]:
    return scene, {**rows, Stage.POSITION: _to_object(scene, rows[Stage.POSITION], index)}


def _rays_in_object_space(scene: Scene, rows: Rows, index: int) -> tuple[Scene, Rows]:
    linear, _ = _linear_and_offset(scene, index)
    return scene, {**rows, Stage.RAY: rows[Stage.RAY] @ np.linalg.inv(linear).T}


def _shape_in_object_space(scene: Scene, rows: Rows, index: int) -> tuple[Scene, Rows]:
    """Return everything in object space but the ray: of a two-sided shape the normal turns by a mixture of both."""
    unplaced = altered(scene.shapes[index], to_world=IDENTITY)
    shapes = (*scene.shapes[:index], unplaced, *scene.shapes[index + 1 :])
    return altered(scene, shapes=shapes), _points_in_object_space(scene, rows, index)[1]


def _lights_in_object_space(scene: Scene, rows: Rows, index: int) -> tuple[Scene, Rows]:
    places = _to_object(scene, np.array([light.position for light in scene.lights]).reshape(-1, 3), index)
    lights = tuple(altered(light, position=plain(place)) for light, place in zip(scene.lights, places, strict=True))
    return altered(scene, lights=lights), rows


def _distances_in_object_space(scene: Scene, rows: Rows) -> np.ndarray:
    """Return distances along directions that were made unit vectors again in object space."""
    answer = rows[Stage.DISTANCE].copy()
    for index in range(len(scene.shapes)):
        here = rows[Stage.OBJECT][:, 0] == index
        stretched = rows[Stage.RAY][here] @ np.linalg.inv(_linear_and_offset(scene, index)[0]).T
        answer[here] *= np.linalg.norm(stretched, axis=1, keepdims=True)
    return answer


def mutants() -> Iterator[Mutant]:
    """Yield the mutants that use a point, direction or light in object space, and those of world normals."""
    uses = {
        "hit.position": (_points_in_object_space, (NORMALS, FEELERS, LIGHT)),
        "hit.ray": (_rays_in_object_space, (NORMALS, LEAVING)),
        "hit.normal": (_shape_in_object_space, (NORMALS,)),
        "light.position": (_lights_in_object_space, (FEELERS, LIGHT)),
    }
    for field, (use, places) in uses.items():
        for place in places:
            (stage,) = STAGES[place]
            steps = {stage: partial(_by_shape, stage, use)}
            what = f"takes {field} in object space for {place}"
            yield mutant(field, f"in_object_space/{place}", what, lambda _, steps=steps: steps)
    distances: dict[Stage, Step] = {Stage.DISTANCE: _distances_in_object_space}
    yield mutant("hit.distance", "in_object_space", "measures distances in object space", lambda _: distances)
    yield from _normals()


def _normals() -> Iterator[Mutant]:
    """Yield the mutants that take normals to world space by another matrix, or do not make them unit vectors."""
    for rule, operation in LINEAR.items():
        by = lambda linear, operation=operation: np.linalg.inv(operation(linear)).T  # noqa: E731
        yield _normal(rule, f"takes normals to world space by a matrix that is {words(rule)}", by, unit=True)
    yield _normal("not_normalised", "does not make world normals unit vectors", lambda linear: np.linalg.inv(linear).T)
    yield _normal("negated", "turns every normal round", lambda linear: -np.linalg.inv(linear).T, unit=True)


def _normal(rule: str, what: str, by: Operation, *, unit: bool = False) -> Mutant:
    """Return the mutant whose world normal is `by` of the model matrix's 3x3 part times the object normal."""

    def step(scene: Scene, rows: Rows) -> np.ndarray:
        answer = NEXT[Stage.NORMAL](scene, rows).copy()
        for index in range(len(scene.shapes)):
            here = rows[Stage.OBJECT][:, 0] == index
            linear, _ = _linear_and_offset(scene, index)
            local = answer[here] @ linear  # M^T n, along the object normal
            local /= np.linalg.norm(local, axis=1, keepdims=True)
            world = local @ by(linear).T
            answer[here] = world / np.linalg.norm(world, axis=1, keepdims=True) if unit else world
        return answer

    steps: dict[Stage, Step] = {Stage.NORMAL: step}
    return mutant("hit.normal", rule, what, lambda _: steps)
