"""Planted fault: the sphere's normal turned inwards."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.normals import NORMALS


@NORMALS.register("sphere_normal/fault_inward", covers=("NRM-1",), kind="fault", stage=Stage.NORMAL)
def fault_inward(point: Any, center: Any) -> Any:
    """Return normalize(center - point)."""
    return dr.normalize(center - point)
