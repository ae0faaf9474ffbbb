"""Planted fault: the albedo applied twice."""

from typing import Any

from rayproof.cases.stages import Stage
from rayproof.tracer.shading import SHADING


@SHADING.register("exitance/fault_albedo_squared", covers=("RAD-4",), kind="fault", stage=Stage.EXITANCE)
def fault_albedo_squared(albedo: Any, irradiance: Any) -> Any:
    """Return rho^2 E."""
    return albedo * albedo * irradiance
