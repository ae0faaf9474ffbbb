"""Planted fault: lights below the horizon counted as seen."""

from typing import Any

from rayproof.cases.stages import Stage
from rayproof.tracer.feelers import FEELERS


@FEELERS.register(
    "horizon/fault_never",
    covers=("LIT-1",),
    kind="fault",
    says="does not ask whether a light is above the horizon of the surface",
    stage=Stage.VISIBILITY,
)
def fault_never(cosine: Any) -> Any:
    """Return False everywhere."""
    return (cosine < 0) & (cosine > 0)
