"""A hit lies on its ray, as far along as the distance says."""

from collections.abc import Iterator

import numpy as np

from rayproof.cases.laws import LAWS
from rayproof.cases.relations import Ask, Relation
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage


@LAWS.register("point_on_ray", stage=Stage.POSITION, implicates=("XF-1", "XF-2"), staged=True)
def point_on_ray(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Follow each ray by its distance: that is the position, and on a miss both say so.

    Proof: x = eye + t d, with d of length 1 in world space. Source: specification, stages and XF-1.
    """
    answers = ask(scene)
    if all(stage in answers for stage in (Stage.RAY, Stage.OBJECT, Stage.DISTANCE, Stage.POSITION)):
        distance = answers[Stage.DISTANCE]
        hit = answers[Stage.OBJECT][..., :1] >= 0
        there = np.asarray(scene.camera.eye) + np.where(hit, distance, 0.0) * answers[Stage.RAY]
        both = {
            Stage.POSITION: (np.where(hit, there, 0.0), answers[Stage.POSITION]),
            Stage.DISTANCE: (np.where(hit, distance, np.inf), distance),
        }
        for stage, (expected, measured) in both.items():
            yield Relation(
                stage=stage, expected=expected, measured=measured, scene=scene, changed=scene, what="eye + t d"
            )
