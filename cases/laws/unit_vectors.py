"""Rays and normals have length 1, and a two-sided surface's normal looks back along the ray."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from rayproof.cases.changes import with_shapes
from rayproof.cases.laws import LAWS
from rayproof.cases.relations import Ask, Relation
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage


@LAWS.register("unit_vectors", stage=Stage.NORMAL, implicates=("CAM-4", "NRM-1", "NRM-3"), staged=True)
def unit_vectors(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Measure rays and normals, of the scene with every surface two-sided: length 1, and dot(N, d) <= 0.

    Proof: both are normalised last, and N is turned towards the viewer. Source: specification, CAM-4, NRM-3.
    """
    changed = with_shapes(scene, lambda shape: replace(shape, two_sided=True))
    answers = ask(changed)

    def relation(stage: Stage, expected: np.ndarray, measured: np.ndarray, what: str) -> Relation:
        return Relation(stage=stage, expected=expected, measured=measured, scene=changed, changed=changed, what=what)

    for stage in (Stage.RAY, Stage.NORMAL):
        if stage in answers:
            lengths = np.linalg.norm(answers[stage], axis=-1, keepdims=True)
            yield relation(stage, np.where(lengths > 0, 1.0, 0.0), lengths, "its length")
    if Stage.RAY in answers and Stage.NORMAL in answers:
        towards = np.sum(answers[Stage.RAY] * answers[Stage.NORMAL], axis=-1, keepdims=True)
        yield relation(Stage.NORMAL, -np.abs(towards), towards, "dot(N, d), two-sided")
