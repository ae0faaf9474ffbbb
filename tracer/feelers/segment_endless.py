"""Control for erratum E10: a feeler "obstructed by an object", wherever that object stands."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.feelers import FEELERS


@FEELERS.register("segment/endless", covers=("LIT-1",), kind="control", stage=Stage.VISIBILITY, erratum="E10")
def endless(origin: Any, light: Any) -> tuple[Any, Any]:
    """Return a ray that goes on behind the light, where a blocker does not count."""
    return light - origin, dr.inf
