"""Control for erratum E9: the clamped cosine alone as "the amount of light" of a point light."""

from typing import Any

from rayproof.cases.stages import Stage
from rayproof.tracer.shading import SHADING


@SHADING.register(
    "falloff/none",
    covers=("RAD-1",),
    kind="control",
    says="leaves out 4 pi r^2, so that light neither spreads nor falls off",
    stage=Stage.IRRADIANCE,
    erratum="E9",
)
def none(flux: Any, squared_distance: Any) -> Any:
    """Return the flux as it is, without 4 pi r^2."""
    return flux
