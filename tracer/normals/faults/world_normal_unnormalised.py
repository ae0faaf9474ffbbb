"""Planted fault: the world normal not renormalised."""

from typing import Any

from rayproof.cases.stages import Stage
from rayproof.tracer.normals import NORMALS
from rayproof.tracer.placement import Placement


@NORMALS.register("world_normal/fault_unnormalised", covers=("NRM-3", "XF-2"), kind="fault", stage=Stage.NORMAL)
def fault_unnormalised(normal: Any, placement: Placement) -> Any:
    """Return the inverse transpose times the normal, of whatever length."""
    return placement.normal_to_world(normal)
