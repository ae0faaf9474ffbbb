"""Planted fault: feelers that end before the light, at 0.9 of the way."""

from typing import Any

from rayproof.cases.stages import Stage
from rayproof.tracer.feelers import FEELERS


@FEELERS.register(
    "segment/fault_short",
    covers=("LIT-1",),
    kind="fault",
    says="lets its shadow rays end 10 % before the light",
    stage=Stage.VISIBILITY,
    bounded=True,
    cases=("along_the_way/before_the_light",),
)
def fault_short(origin: Any, light: Any) -> tuple[Any, Any]:
    """Return the direction light - origin, and an end of 0.9 where the light stands at 1."""
    return light - origin, 0.9
