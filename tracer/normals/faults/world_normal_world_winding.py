"""Planted fault: the normal taken from world-space winding, which a mirror turns round."""

from typing import Any

import drjit as dr
import numpy as np

from rayproof.cases.stages import Stage
from rayproof.tracer.normals import NORMALS
from rayproof.tracer.placement import Placement


@NORMALS.register(
    "world_normal/fault_world_winding",
    covers=("NRM-3", "XF-2"),
    kind="fault",
    says="derives normals from the winding in the world, which a mirror turns round",
    cases=("transforms/*_mirrored", "normals/mirrored"),
    stage=Stage.NORMAL,
)
def fault_world_winding(normal: Any, placement: Placement) -> Any:
    """Return the world normal, inward under a mirror."""
    side = float(np.sign(np.linalg.det(placement.linear)))
    return dr.normalize(placement.normal_to_world(normal)) * side
