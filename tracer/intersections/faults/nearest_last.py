"""Planted fault: the last hit kept in place of the nearest."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.intersections import INTERSECTIONS


@INTERSECTIONS.register("nearest/fault_last", covers=("HIT-9",), kind="fault", stage=Stage.OBJECT)
def fault_last(distance: Any, best: Any) -> Any:
    """Return where anything is hit."""
    return (distance < dr.inf) & (best >= 0)
