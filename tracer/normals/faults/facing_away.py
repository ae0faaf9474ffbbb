"""Planted fault: the normal of a two-sided surface turned away from the viewer."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.normals import NORMALS


@NORMALS.register(
    "facing/fault_away",
    covers=("NRM-3",),
    kind="fault",
    says="turns the normals of two-sided surfaces away from the viewer",
    stage=Stage.NORMAL,
)
def fault_away(normal: Any, direction: Any) -> Any:
    """Return the normal turned along the ray."""
    return dr.select(dr.dot(normal, direction) < 0, -normal, normal)
