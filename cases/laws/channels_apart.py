"""What one channel holds does not depend on the others."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from rayproof.cases.changes import vector, with_lights
from rayproof.cases.laws import LAWS
from rayproof.cases.relations import LIGHT, Ask, Conditions, Relation, related
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage

RED = np.array((1.0, 0.0, 0.0))


@LAWS.register("channels_apart", stage=Stage.IRRADIANCE, implicates=("RAD-1", "RAD-4"))
def channels_apart(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Take green and blue out of every flux: red stays to the last bit, green and blue are 0.

    Proof: the specification's formulas are the same for each channel, and none has two channels in it.
    Source: specification, RAD-1 to RAD-4.
    """
    if scene.lights:
        red = (replace(light, flux=vector(np.asarray(light.flux) * RED)) for light in scene.lights)
        before = {stage: lambda image: image * RED for stage in LIGHT}
        conditions = Conditions(exact=True)
        changed = with_lights(scene, *red)
        yield from related(ask, scene, changed, what="only red light", before=before, conditions=conditions)
