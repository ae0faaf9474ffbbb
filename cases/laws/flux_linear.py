"""Light is proportional to flux."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from rayproof.cases.changes import vector, with_lights
from rayproof.cases.laws import LAWS
from rayproof.cases.relations import LIGHT, Ask, Relation, related
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage

FACTORS = np.array((3.0, 0.7, 11.0))


@LAWS.register("flux_linear", stage=Stage.IRRADIANCE, implicates=("RAD-1", "RAD-3", "RAD-4", "RAD-5"))
def flux_linear(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Multiply every light's flux by 3, 0.7 and 11, channel by channel: irradiance, exitance, radiance go with it.

    Proof: E is a sum over lights of Phi times what does not depend on Phi, and M and L are E times constants.
    Source: Kajiya, The Rendering Equation (1986); specification, RAD-1 and RAD-5.
    """
    if scene.lights:
        brighter = (replace(light, flux=vector(np.asarray(light.flux) * FACTORS)) for light in scene.lights)
        changed = with_lights(scene, *brighter)
        before = {stage: lambda image: image * FACTORS for stage in LIGHT}
        yield from related(ask, scene, changed, what="flux times (3, 0.7, 11)", before=before)
