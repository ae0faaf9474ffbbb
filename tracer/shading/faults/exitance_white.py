"""Planted fault: the albedo forgotten."""

from typing import Any

from rayproof.cases.stages import Stage
from rayproof.tracer.shading import SHADING


@SHADING.register("exitance/fault_white", covers=("RAD-4",), kind="fault", stage=Stage.EXITANCE)
def fault_white(albedo: Any, irradiance: Any) -> Any:
    """Return E."""
    return irradiance + 0 * albedo
