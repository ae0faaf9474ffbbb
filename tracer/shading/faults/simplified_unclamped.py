"""Planted fault: the simplified model's cosine not clamped."""

from typing import Any

from rayproof.cases.stages import Stage
from rayproof.tracer.shading import SHADING


@SHADING.register(
    "simplified/fault_unclamped",
    covers=("RAD-3",),
    kind="fault",
    says="does not clamp the cosine to zero under the simplified light",
    stage=Stage.IRRADIANCE,
)
def fault_unclamped(flux: Any, cosine: Any) -> Any:
    """Return RGB dot(N, L)."""
    return flux * cosine
