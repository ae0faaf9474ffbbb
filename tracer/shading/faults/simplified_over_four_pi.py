"""Planted fault: the light's RGB taken for a flux and spread over the sphere."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.shading import SHADING


@SHADING.register(
    "simplified/fault_over_four_pi",
    covers=("RAD-3",),
    kind="fault",
    says="divides by 4 pi under the simplified light, too",
    stage=Stage.IRRADIANCE,
)
def fault_over_four_pi(flux: Any, cosine: Any) -> Any:
    """Return RGB cos / (4 pi)."""
    return flux / (4 * dr.pi) * dr.select(cosine <= 0, 0, cosine)
