"""Planted fault: the cosine not clamped below the horizon."""

from typing import Any

from rayproof.cases.stages import Stage
from rayproof.tracer.shading import SHADING


@SHADING.register(
    "lambert/fault_unclamped",
    covers=("RAD-2",),
    kind="fault",
    says="does not clamp the cosine to zero, so that lights below the horizon darken",
    stage=Stage.IRRADIANCE,
)
def fault_unclamped(irradiance: Any, cosine: Any) -> Any:
    """Return E dot(N, L), negative below the horizon."""
    return irradiance * cosine
