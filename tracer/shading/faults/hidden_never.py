"""Planted fault: one-sided surfaces treated as two-sided: their backs shine."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.shading import SHADING


@SHADING.register(
    "hidden/fault_never",
    covers=("RAD-4",),
    kind="fault",
    cases=("sidedness/*_behind", "sidedness/*_one_sided"),
    stage=Stage.RADIANCE,
)
def fault_never(normal: Any, direction: Any) -> Any:
    """Return False everywhere."""
    return (dr.dot(normal, direction) < 0) & (dr.dot(normal, direction) > 0)
