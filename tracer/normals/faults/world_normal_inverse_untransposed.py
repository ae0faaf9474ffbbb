"""Planted fault: the inverse used without its transpose."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.normals import NORMALS
from rayproof.tracer.placement import Placement


@NORMALS.register("world_normal/fault_inverse_untransposed", covers=("NRM-3", "XF-2"), kind="fault", stage=Stage.NORMAL)
def fault_inverse_untransposed(normal: Any, placement: Placement) -> Any:
    """Return the inverse matrix times the normal, renormalised."""
    return dr.normalize(placement.vector_to_object(normal))
