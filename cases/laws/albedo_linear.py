"""Reflected light is proportional to albedo."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from rayproof.cases.changes import vector, with_shapes
from rayproof.cases.laws import LAWS
from rayproof.cases.relations import Ask, Relation, related
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage

FACTORS = np.array((0.3, 0.9, 0.6))


@LAWS.register("albedo_linear", stage=Stage.EXITANCE, implicates=("RAD-4",))
def albedo_linear(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Multiply every albedo by 0.3, 0.9 and 0.6, channel by channel: exitance and radiance go with it, E stays.

    Proof: M = albedo E, and E does not depend on albedo, since light is reflected only once.
    Source: specification, RAD-4.
    """
    changed = with_shapes(scene, lambda shape: replace(shape, albedo=vector(np.asarray(shape.albedo) * FACTORS)))
    before = {stage: lambda image: image * FACTORS for stage in (Stage.EXITANCE, Stage.RADIANCE)}
    yield from related(ask, scene, changed, what="albedos times (0.3, 0.9, 0.6)", before=before)
