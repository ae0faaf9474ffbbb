"""Lights add: rays do not interact."""

from typing import Any

from rayproof.cases.stages import Stage
from rayproof.tracer.shading import SHADING


@SHADING.register("sum_lights/all", covers=("LIT-1", "RAD-5"), kind="right", stage=Stage.IRRADIANCE, default=True)
def every(contributions: list[Any]) -> Any:
    """Return the sum of all contributions."""
    total = contributions[0]
    for contribution in contributions[1:]:
        total = total + contribution
    return total
