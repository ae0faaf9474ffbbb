"""Planted fault: the feeler missing: every light above the horizon is seen."""

from typing import Any

from rayproof.cases.stages import Stage
from rayproof.tracer.feelers import FEELERS


@FEELERS.register("obstructed/fault_never", covers=("LIT-1",), kind="fault", stage=Stage.VISIBILITY)
def fault_never(distance: Any) -> Any:
    """Return False everywhere."""
    return (distance < 0) & (distance > 0)
