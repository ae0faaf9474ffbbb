"""Planted fault: 4 pi missing, as if flux were intensity."""

from typing import Any

from rayproof.cases.stages import Stage
from rayproof.tracer.shading import SHADING


@SHADING.register("falloff/fault_no_four_pi", covers=("RAD-1",), kind="fault", stage=Stage.IRRADIANCE)
def fault_no_four_pi(flux: Any, squared_distance: Any) -> Any:
    """Return Phi / r^2."""
    return flux / squared_distance
