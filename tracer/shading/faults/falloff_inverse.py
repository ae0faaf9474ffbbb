"""Planted fault: 1/r in place of 1/r^2."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.shading import SHADING


@SHADING.register("falloff/fault_inverse", covers=("RAD-1",), kind="fault", stage=Stage.IRRADIANCE)
def fault_inverse(flux: Any, squared_distance: Any) -> Any:
    """Return Phi / (4 pi r)."""
    return flux / (4 * dr.pi) / dr.sqrt(squared_distance)
