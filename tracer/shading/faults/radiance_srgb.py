"""Planted fault: the sRGB transfer curve applied to linear radiance."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.shading import SHADING


@SHADING.register("radiance/fault_srgb", covers=("RAD-4",), kind="fault", stage=Stage.RADIANCE)
def fault_srgb(exitance: Any) -> Any:
    """Return L as a display would get it."""
    linear: Any = exitance / dr.pi
    curved: Any = dr.power(linear, 1 / 2.4)
    return dr.select(linear <= 0.0031308, 12.92 * linear, 1.055 * curved - 0.055)
