"""Planted fault: 1/pi missing."""

from typing import Any

from rayproof.cases.stages import Stage
from rayproof.tracer.shading import SHADING


@SHADING.register("radiance/fault_no_pi", covers=("RAD-4",), kind="fault", stage=Stage.RADIANCE)
def fault_no_pi(exitance: Any) -> Any:
    """Return M."""
    return exitance
