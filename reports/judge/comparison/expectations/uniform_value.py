"""A closed form at every pixel that sees a shape: the pixel that is farthest off counts."""

import numpy as np

from rayproof.cases.case import UniformValue
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage, StageImages
from rayproof.reports.judge.comparison.expectations import EXPECTATIONS, Finding


@EXPECTATIONS.register("UniformValue")
def uniform_value(expectation: UniformValue, scene: Scene, answers: StageImages, slack: float) -> Finding:
    """Compare the worst pixel of the shape."""
    seen = answers[Stage.OBJECT][..., 0] == expectation.shape
    values = answers[expectation.stage][seen][:, expectation.channel]
    limit = (expectation.relative + slack) * abs(expectation.value)
    if not len(values):
        return Finding(measured=float("nan"), expected=expectation.value, limit=limit, used=0)
    off = np.nan_to_num(np.abs(values - expectation.value), nan=np.inf)
    return Finding(measured=float(values[off.argmax()]), expected=expectation.value, limit=limit, used=len(values))
