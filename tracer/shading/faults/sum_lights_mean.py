"""Planted fault: the mean of the lights in place of their sum."""

from typing import Any

from rayproof.cases.stages import Stage
from rayproof.tracer.shading import SHADING


@SHADING.register("sum_lights/fault_mean", covers=("RAD-5",), kind="fault", stage=Stage.IRRADIANCE)
def fault_mean(contributions: list[Any]) -> Any:
    """Return the mean contribution."""
    total = contributions[0]
    for contribution in contributions[1:]:
        total = total + contribution
    return total / len(contributions)
