"""What a feeler that met something means."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.feelers import FEELERS


@FEELERS.register("obstructed/any_hit", covers=("LIT-1",), kind="right", stage=Stage.VISIBILITY, default=True)
def any_hit(distance: Any) -> Any:
    """Return where the feeler met something: a blocked light adds pure black."""
    return distance < dr.inf
