"""Planted fault: the normal of a two-sided surface never turned towards the viewer."""

from typing import Any

from rayproof.cases.stages import Stage
from rayproof.tracer.normals import NORMALS


@NORMALS.register("facing/fault_never", covers=("NRM-3",), kind="fault", stage=Stage.NORMAL)
def fault_never(normal: Any, direction: Any) -> Any:
    """Return the outward normal."""
    return normal
