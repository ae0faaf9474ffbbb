"""Planted fault: a hit counted only in the first half of the way to the light."""

from typing import Any

from rayproof.cases.stages import Stage
from rayproof.tracer.feelers import FEELERS


@FEELERS.register(
    "obstructed/fault_nearer_than_light",
    covers=("LIT-1",),
    kind="fault",
    says="lets only the nearer half of the way to a light be blocked",
    stage=Stage.VISIBILITY,
)
def fault_nearer_than_light(distance: Any) -> Any:
    """Return where something is met before the middle of the feeler."""
    return distance < 0.5
