"""Lambert's cosine law."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.shading import SHADING


@SHADING.register("lambert/cosine", covers=("RAD-2",), kind="right", stage=Stage.IRRADIANCE, default=True)
def cosine_law(irradiance: Any, cosine: Any) -> Any:
    """Return E dot(N, L), zero below the horizon. A NaN stays one."""
    return dr.select(cosine <= 0, 0, irradiance * cosine)
