"""Planted fault: the horizon's sign turned round."""

from typing import Any

from rayproof.cases.stages import Stage
from rayproof.tracer.feelers import FEELERS


@FEELERS.register(
    "horizon/fault_reversed",
    covers=("LIT-1",),
    kind="fault",
    says="asks the wrong way round whether a light is above the horizon",
    stage=Stage.VISIBILITY,
)
def fault_reversed(cosine: Any) -> Any:
    """Return where the light is above the horizon."""
    return cosine > 0
