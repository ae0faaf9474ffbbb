"""Stage truth: exact mathematics on the floats that a stage received, and how much those floats magnify rounding."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from rayproof.cases.rounding import UNIT_ROUNDOFF
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage, StageImages
from rayproof.reference.analytic import Analytic
from rayproof.reference.double_double import DoubleDouble
from rayproof.reports.judge.conditioning import condition, off_axis, ray_condition
from rayproof.reports.judge.limits import LIGHT, Roundoff, continued_light_limit

GEOMETRY = (Stage.OBJECT, Stage.DISTANCE, Stage.POSITION, Stage.NORMAL)


class Oracle(Protocol):
    """What is asked of an oracle here."""

    def continue_from(self, scene: Scene, stage: Stage, given: StageImages) -> np.ndarray:
        """Return a stage computed from the given earlier ones."""
        ...


def oracle_for(scene: Scene, precisions: set[str]) -> tuple[str, Oracle]:
    """Return name and oracle, its own rounding far below the coarsest of `precisions` and, if it can, the finest."""
    if precisions != {"float32"}:
        finest = DoubleDouble()
        if finest.unsupported(scene, Stage.RADIANCE) is None:
            return "double_double", finest
    return "analytic", Analytic()


@dataclass(frozen=True, kw_only=True)
class Truth:
    """What exact mathematics makes of one stage's inputs."""

    value: np.ndarray  # (height, width, channels); of `object` the distance
    objects: np.ndarray | None  # (height, width, 2): the true object, where the stage is to find one
    counts: np.ndarray  # (height, width) bool: the pixels at which the stage has a value
    magnified: np.ndarray  # (height, width) or (height, width, channels): K |X|, the error that one roundoff excuses


def truth_of(scene: Scene, stage: Stage, given: StageImages, oracle: Oracle) -> Truth:
    """Return the truth of an image stage, continued from `given`; the truth of `object` is a distance too.

    Raises:
        ValueError: the camera stage, which is no image.

    """
    size = (scene.camera.height, scene.camera.width)
    if stage in (Stage.OBJECT, Stage.DISTANCE):
        seen: StageImages = {Stage.RAY: given[Stage.RAY]}
        for each in GEOMETRY:
            seen[each] = oracle.continue_from(scene, each, seen)
        there = condition(scene, seen)
        return Truth(
            value=seen[Stage.DISTANCE], objects=seen[Stage.OBJECT], counts=there.hit, magnified=there.along_ray
        )
    value = oracle.continue_from(scene, stage, given)
    if stage is Stage.RAY:
        return Truth(
            value=value,
            objects=None,
            counts=np.ones(size, dtype=bool),
            magnified=ray_condition(scene.camera, off_axis(scene.camera, value)),
        )
    return Truth(
        value=value,
        objects=None,
        counts=given[Stage.OBJECT][..., 0] >= 0,
        magnified=_magnified(scene, stage, given, value),
    )


def _magnified(scene: Scene, stage: Stage, given: StageImages, value: np.ndarray) -> np.ndarray:
    """Return K |X| of the stages after the distance."""
    if stage is Stage.POSITION:
        distance = given[Stage.DISTANCE][..., 0]
        return float(np.linalg.norm(scene.camera.eye)) + np.where(np.isfinite(distance), np.abs(distance), 0.0)
    if stage is Stage.NORMAL:
        there = condition(scene, {**given, Stage.NORMAL: value})
        return there.matrix * (1 + there.local)
    if stage is Stage.IRRADIANCE:
        limit = continued_light_limit(scene, stage, given, value, Roundoff("float32"))
        return limit / LIGHT / UNIT_ROUNDOFF["float32"]
    return np.abs(value)
