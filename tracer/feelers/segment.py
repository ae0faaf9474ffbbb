"""The segment that a feeler tests: strictly between the point and the light."""

from typing import Any

from rayproof.cases.stages import Stage
from rayproof.tracer.feelers import FEELERS


@FEELERS.register(
    "segment/to_light", covers=("LIT-1",), kind="right", stage=Stage.VISIBILITY, default=True, bounded=True
)
def to_light(origin: Any, light: Any) -> tuple[Any, Any]:
    """Return the direction light - origin, so that the light stands at t = 1, and the end 1."""
    return light - origin, 1.0
