"""The cosine between a surface's normal and the way to a light."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.shading import SHADING


@SHADING.register("cosine/direct", covers=("RAD-2",), kind="right", stage=Stage.IRRADIANCE, default=True)
def direct(normal: Any, away: Any) -> Any:
    """Return dot(N, away) / abs(away); the falloff needs 1 / abs(away)^2 as well."""
    squared = dr.squared_norm(away)
    # 0 times infinity for a light exactly at the point, where irradiance is defined to be 0.
    return dr.select(squared == 0, 0, dr.dot(normal, away) * dr.sqrt(1 / squared))
