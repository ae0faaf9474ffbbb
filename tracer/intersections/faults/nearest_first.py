"""Planted fault: the first hit kept in place of the nearest."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.intersections import INTERSECTIONS


@INTERSECTIONS.register("nearest/fault_first", covers=("HIT-9",), kind="fault", stage=Stage.OBJECT)
def fault_first(distance: Any, best: Any) -> Any:
    """Return where nothing was hit before."""
    return (best == dr.inf) & (distance < dr.inf)
