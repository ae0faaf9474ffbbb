"""Light is never negative, and is a number."""

from collections.abc import Iterator

import numpy as np

from rayproof.cases.laws import LAWS
from rayproof.cases.relations import LIGHT, Ask, Conditions, Relation
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage


@LAWS.register("not_negative", stage=Stage.IRRADIANCE, implicates=("RAD-2", "RAD-3", "LIT-1"))
def not_negative(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Look at the scene as it is: no value of light is below 0, infinite or no number.

    Proof: E is a sum of products of what is not negative; below the horizon a light gives 0.
    Source: Lambert, Photometria (1760); specification, RAD-2.
    """
    answers = ask(scene)
    for stage in LIGHT:
        if stage in answers:
            image = answers[stage]
            yield Relation(
                stage=stage,
                expected=np.maximum(np.nan_to_num(image, posinf=0.0), 0.0),
                measured=image,
                scene=scene,
                changed=scene,
                what="the scene as it is",
                conditions=Conditions(exact=True),
            )
