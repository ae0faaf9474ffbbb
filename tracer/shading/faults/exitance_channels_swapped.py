"""Planted fault: red and blue swapped."""

from typing import Any

from rayproof.cases.stages import Stage
from rayproof.tracer.shading import SHADING


@SHADING.register("exitance/fault_channels_swapped", covers=("RAD-4",), kind="fault", stage=Stage.EXITANCE)
def fault_channels_swapped(albedo: Any, irradiance: Any) -> Any:
    """Return M in the order B, G, R."""
    found = albedo * irradiance
    return type(found)(found.z, found.y, found.x)
