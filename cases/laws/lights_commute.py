"""Lights may come in any order."""

from collections.abc import Iterator

import numpy as np

from rayproof.cases.changes import at_least_two, with_lights
from rayproof.cases.laws import LAWS
from rayproof.cases.relations import Ask, Relation, related
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage


@LAWS.register("lights_commute", stage=Stage.VISIBILITY, implicates=("LIT-1", "RAD-5"))
def lights_commute(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """List the lights backwards: visibility comes backwards, and the light stays.

    Proof: E is a sum over lights, and sums commute up to rounding. Source: specification, LIT-1 and RAD-5.
    """
    if scene.lights:
        first = at_least_two(scene)
        changed = with_lights(first, *first.lights[::-1])
        before = {Stage.VISIBILITY: lambda image: np.flip(image, axis=-1)}
        yield from related(ask, first, changed, what="the lights listed backwards", before=before)
