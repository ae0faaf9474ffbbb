"""Radiance of a diffuse surface, the same in all directions and along the whole ray."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.shading import SHADING


@SHADING.register("radiance/diffuse", covers=("RAD-4", "RAD-5"), kind="right", stage=Stage.RADIANCE, default=True)
def diffuse(exitance: Any) -> Any:
    """Return L = M / pi [W/(m^2 sr)]."""
    return exitance / dr.pi
