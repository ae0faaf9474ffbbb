"""Radiant exitance of a diffuse surface."""

from typing import Any

from rayproof.cases.stages import Stage
from rayproof.tracer.shading import SHADING


@SHADING.register("exitance/albedo", covers=("RAD-4",), kind="right", stage=Stage.EXITANCE, default=True)
def exitance(albedo: Any, irradiance: Any) -> Any:
    """Return M = rho E [W/m^2]."""
    return albedo * irradiance
