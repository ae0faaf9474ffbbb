"""Irradiance of an isotropic point light on a surface that faces it: flux over the sphere's area."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.shading import SHADING


@SHADING.register("falloff/inverse_square", covers=("RAD-1",), kind="right", stage=Stage.IRRADIANCE, default=True)
def inverse_square(flux: Any, squared_distance: Any) -> Any:
    """Return Phi / (4 pi r^2) [W/m^2]."""
    return flux / (4 * dr.pi) / squared_distance
