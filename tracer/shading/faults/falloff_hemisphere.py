"""Planted fault: 2 pi in place of 4 pi, as if the light shone into a hemisphere."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.shading import SHADING


@SHADING.register("falloff/fault_hemisphere", covers=("RAD-1",), kind="fault", stage=Stage.IRRADIANCE)
def fault_hemisphere(flux: Any, squared_distance: Any) -> Any:
    """Return Phi / (2 pi r^2)."""
    return flux / (2 * dr.pi) / squared_distance
