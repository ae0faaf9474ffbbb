"""Planted fault: the normal taken to world space as if it were a direction."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.normals import NORMALS
from rayproof.tracer.placement import Placement


@NORMALS.register("world_normal/fault_model_matrix", covers=("NRM-3", "XF-2"), kind="fault", stage=Stage.NORMAL)
def fault_model_matrix(normal: Any, placement: Placement) -> Any:
    """Return the model matrix times the normal, renormalised."""
    return dr.normalize(placement.vector_to_world(normal))
