"""Shapes may come in any order."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from rayproof.cases.changes import coincide
from rayproof.cases.laws import LAWS
from rayproof.cases.relations import Ask, Relation, related
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage


@LAWS.register("shapes_commute", stage=Stage.OBJECT, implicates=("HIT-9", "LIT-1"))
def shapes_commute(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """List the shapes backwards: object indices come backwards, and nothing else changes.

    Proof: the nearest hit is the least of a set, and so is whether any shape blocks a feeler.
    Where two shapes' sides
    lie in one plane there is no nearest, and the law says nothing. Source: specification, HIT-9.
    """
    count = len(scene.shapes)
    if count < 2 or coincide(scene):
        return

    def renamed(image: np.ndarray) -> np.ndarray:
        return np.stack([np.where(image[..., 0] >= 0, count - 1 - image[..., 0], -1.0), image[..., 1]], axis=-1)

    changed = replace(scene, shapes=scene.shapes[::-1])
    yield from related(ask, scene, changed, what="the shapes listed backwards", before={Stage.OBJECT: renamed})
