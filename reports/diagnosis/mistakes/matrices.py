"""Fits of the model matrix, its inverse and transposes for points, rays, normals and sidedness: XF-1, XF-2, NRM-3.

Rays go into object space by the inverse, normals come out of it by the inverse transpose. Here every other matrix is
tried for points, directions and normals, with and without normalising, and every mixture of the two spaces in the
question whether a surface is seen from behind.
"""

from collections.abc import Callable, Iterator, Mapping

import numpy as np

from rayproof.cases.placement import placed
from rayproof.cases.rounding import gamma
from rayproof.cases.scene import Shape
from rayproof.cases.stages import Stage
from rayproof.reports.diagnosis import MISTAKES, Given, Mistake, Way, Wrong
from rayproof.reports.diagnosis.mistakes.normals import (
    IntoObject,
    Normals,
    around,
    blocked_by_its_own_face,
    outward_normals,
    way_by,
)
from rayproof.reports.judge.answers import dot, length

MATRICES: Mapping[str, Callable[[np.ndarray], np.ndarray]] = {
    "the inverse model matrix": np.linalg.inv,
    "the model matrix": lambda matrix: matrix,
    "the transposed model matrix": np.transpose,
    "the inverse transpose": lambda matrix: np.linalg.inv(matrix).T,
}
RIGHT_OF_RAYS, RIGHT_OF_NORMALS = "the inverse model matrix", "the inverse transpose"
# How the translation enters: before the matrix, after it, or not at all.
TRANSLATIONS: Mapping[str, Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]] = {
    "": lambda points, matrix, offset: (points - offset) @ matrix.T,
    " with the translation added afterwards": lambda points, matrix, offset: points @ matrix.T + offset,
    " with the translation taken off afterwards": lambda points, matrix, offset: points @ matrix.T - offset,
    " without the translation": lambda points, matrix, offset: points @ matrix.T,
}
# The cosine that is positive where a surface is seen from behind, from the shape, its unit normals in the world and the
# rays there (n, 3).
Behind = Callable[[Shape, np.ndarray, np.ndarray], np.ndarray]


EDGE_ON = gamma(16, precision="float32")  # rounding says on which side of a surface so small a cosine is


def _into(of_points: str, of_translation: str, of_directions: str, *, unit: bool) -> IntoObject:
    def into(
        linear: np.ndarray, offset: np.ndarray, origins: np.ndarray, directions: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        turned = directions @ MATRICES[of_directions](linear).T
        if unit:
            turned = turned / length(turned)[..., np.newaxis]
        return TRANSLATIONS[of_translation](origins, MATRICES[of_points](linear), offset), turned

    return into


def _rays() -> Iterator[Way]:
    """Yield the ways of renderers that bring rays into object space by other matrices."""
    for of_points in MATRICES:
        for of_translation in TRANSLATIONS:
            for of_directions in MATRICES:
                for unit in (False, True):
                    points = f"points by {of_points}{of_translation}"
                    directions = f"directions by {of_directions}{' and normalises them' if unit else ''}"
                    rightly = (of_points, of_translation) == (RIGHT_OF_RAYS, "")
                    if rightly and (of_directions, unit) == (RIGHT_OF_RAYS, False):
                        continue
                    says = f"brings {'' if rightly else points + ' and '}{directions} into object space"
                    way = way_by(_into(of_points, of_translation, of_directions, unit=unit))
                    yield Way(stages=way.stages, says=says)


def _turned(of_normals: str) -> Wrong:
    matrix = MATRICES[of_normals]

    def turned(shape: Shape, points: np.ndarray, outward: np.ndarray) -> np.ndarray:
        local = outward @ placed(shape)[0]
        size = length(local)[..., np.newaxis]
        return np.divide(local, size, out=np.zeros_like(local), where=size > 0) @ matrix(placed(shape)[0]).T

    return Normals(turned=(turned,))


def _normals() -> Iterator[Way]:
    """Yield the ways of renderers that bring normals into the world by other matrices and do not normalise them."""
    for name in MATRICES:
        if name != RIGHT_OF_NORMALS:
            yield from around(_turned(name), f"turns normals by {name} and does not normalise them")


def _mirrored(shape: Shape, normals: np.ndarray, rays: np.ndarray) -> np.ndarray:
    return dot(normals, rays) * np.sign(np.linalg.det(placed(shape)[0]))


def _rays_of_object_space(shape: Shape, normals: np.ndarray, rays: np.ndarray) -> np.ndarray:
    turned = rays @ np.linalg.inv(placed(shape)[0]).T
    return dot(normals, turned) / length(turned)


def _normals_of_object_space(shape: Shape, normals: np.ndarray, rays: np.ndarray) -> np.ndarray:
    turned = normals @ placed(shape)[0]
    return dot(turned, rays) / length(turned)


FACING: Mapping[str, Behind] = {
    "by the normal of object space and the ray of the world": _normals_of_object_space,
    "by the normal of the world and the ray of object space": _rays_of_object_space,
    "the other way round where the model matrix mirrors": _mirrored,
}


def _turned_round(behind: Behind) -> Wrong:
    """Return the normals, those of two-sided shapes turned by another decision on what is seen from behind."""

    def wrong(given: Given) -> np.ndarray:
        found = np.array(given.right, dtype=np.float64)
        outward = outward_normals(given)
        for index, shape in enumerate(given.scene.shapes):
            here = given.answers[Stage.OBJECT][..., 0] == index
            turns = (behind(shape, outward[here], given.answers[Stage.RAY][here]) > 0) & shape.two_sided
            found[here] = np.where(turns[:, np.newaxis], -outward[here], outward[here])
        return found

    return wrong


def _hidden(behind: Behind) -> Wrong:
    """Return radiance with one-sided surfaces hidden by another decision; NaN where rounding alone makes it."""

    def wrong(given: Given) -> np.ndarray:
        scale = 1.0 if given.scene.shading == "simplified" else 1 / np.pi
        found = np.array(given.answers[Stage.EXITANCE] * scale, dtype=np.float64)
        for index, shape in enumerate(given.scene.shapes):
            here = given.answers[Stage.OBJECT][..., 0] == index
            if not shape.two_sided:
                outward, rays = given.answers[Stage.NORMAL][here], given.answers[Stage.RAY][here]
                away = behind(shape, outward, rays)[:, np.newaxis]
                found[here] = np.where(np.abs(away) <= EDGE_ON, np.nan, np.where(away > 0, 0.0, found[here]))
        return found

    return wrong


def _facing() -> Iterator[Way]:
    """Yield the ways of renderers that decide in other spaces what is seen from behind."""
    for how, behind in FACING.items():
        turned = {Stage.NORMAL: _turned_round(behind)}
        hidden = {Stage.RADIANCE: _hidden(behind)}
        of_two, of_one = "turns normals of two-sided surfaces towards the viewer", "hides one-sided surfaces"
        for own in ({}, {Stage.VISIBILITY: blocked_by_its_own_face}):
            yield Way(stages=turned | hidden | own, says=f"tells front from back {how}")
        yield from around(turned[Stage.NORMAL], f"{of_two} {how}")
        yield Way(stages=hidden, says=f"{of_one} {how}")


MISTAKES.register("ray_by_another_matrix")(
    Mistake(
        says="brings rays into object space by another matrix than the inverse model matrix",
        items=("XF-1",),
        ways=(way_by(_into(RIGHT_OF_RAYS, "", "the inverse transpose", unit=False)),),
        fitted=lambda cases: _rays(),
    )
)
MISTAKES.register("normal_by_another_matrix")(
    Mistake(
        says="brings normals into the world by another matrix than the inverse transpose, without normalising them",
        items=("NRM-3", "XF-2"),
        ways=(next(_normals()),),
        fitted=lambda cases: _normals(),
    )
)
MISTAKES.register("facing_in_another_space")(
    Mistake(
        says="decides in mixed spaces whether a surface is seen from behind",
        items=("NRM-3", "RAD-4"),
        ways=(next(_facing()),),
        fitted=lambda cases: _facing(),
    )
)
