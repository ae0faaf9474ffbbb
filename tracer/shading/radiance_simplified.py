"""Radiance in the lecture's simplified model."""

from typing import Any

from rayproof.cases.stages import Stage
from rayproof.tracer.shading import SHADING


@SHADING.register("radiance_simplified/same", covers=("RAD-3",), kind="right", stage=Stage.RADIANCE, default=True)
def same(exitance: Any) -> Any:
    """Return the exitance as it is: the model has no 1/pi."""
    return exitance
