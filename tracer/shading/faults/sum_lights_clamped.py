"""Planted fault: the sum of lights clamped to 1."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.shading import SHADING


@SHADING.register("sum_lights/fault_clamped", covers=("RAD-3", "RAD-5"), kind="fault", stage=Stage.IRRADIANCE)
def fault_clamped(contributions: list[Any]) -> Any:
    """Return the sum, at most 1."""
    total = contributions[0]
    for contribution in contributions[1:]:
        total = total + contribution
    return dr.minimum(total, 1.0)
