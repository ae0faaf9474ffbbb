"""The lecture's simplified point light: its colour and a clamped cosine, without falloff."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.shading import SHADING


@SHADING.register("simplified/clamped_cosine", covers=("RAD-3",), kind="right", stage=Stage.IRRADIANCE, default=True)
def clamped_cosine(flux: Any, cosine: Any) -> Any:
    """Return RGB clamp(dot(N, L), 0, 1). A NaN stays one."""
    return flux * dr.select(cosine <= 0, 0, dr.select(cosine > 1, 1, cosine))
