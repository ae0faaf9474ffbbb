"""A closed form for the flux that falls on a rectangle: irradiance times footprint, summed over its pixels."""

import numpy as np

from rayproof.cases.case import Flux
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage, StageImages
from rayproof.reports.judge.comparison.expectations import EXPECTATIONS, Finding


@EXPECTATIONS.register("Flux")
def flux(expectation: Flux, scene: Scene, answers: StageImages, slack: float) -> Finding:
    """Compare the sum over the pixels that see the rectangle."""
    objects = answers[Stage.OBJECT]
    seen = objects[..., 0] == expectation.shape
    if expectation.face >= 0:
        seen &= objects[..., 1] == expectation.face
    total = float(np.sum(answers[Stage.IRRADIANCE][seen][:, expectation.channel])) * expectation.footprint
    return Finding(
        measured=total,
        expected=expectation.value,
        limit=(expectation.relative + slack) * abs(expectation.value),
        used=int(np.count_nonzero(seen)),
    )
