"""Planted fault: feelers that end behind the light, at 1.15 of the way."""

from typing import Any

from rayproof.cases.stages import Stage
from rayproof.tracer.feelers import FEELERS


@FEELERS.register(
    "segment/fault_long",
    covers=("LIT-1",),
    kind="fault",
    says="lets its shadow rays run 15 % farther than the light",
    stage=Stage.VISIBILITY,
    bounded=True,
    cases=("along_the_way/behind_the_light",),
)
def fault_long(origin: Any, light: Any) -> tuple[Any, Any]:
    """Return the direction light - origin, and an end of 1.15 where the light stands at 1."""
    return light - origin, 1.15
