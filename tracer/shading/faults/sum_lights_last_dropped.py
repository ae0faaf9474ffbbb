"""Planted fault: one light dropped."""

from typing import Any

from rayproof.cases.stages import Stage
from rayproof.tracer.shading import SHADING


@SHADING.register("sum_lights/fault_last_dropped", covers=("RAD-5",), kind="fault", stage=Stage.IRRADIANCE)
def fault_last_dropped(contributions: list[Any]) -> Any:
    """Return the sum without the last of several lights."""
    total = contributions[0]
    for contribution in contributions[1:-1]:
        total = total + contribution
    return total
