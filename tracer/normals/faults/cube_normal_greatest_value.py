"""Planted fault: the greatest coordinate taken in place of the greatest magnitude."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.normals import NORMALS


@NORMALS.register("cube_normal/fault_greatest_value", covers=("NRM-2",), kind="fault", stage=Stage.NORMAL)
def fault_greatest_value(point: Any) -> Any:
    """Return the signed axis of the greatest value."""
    along_x = (point.x >= point.y) & (point.x >= point.z)
    along_y = ~along_x & (point.y >= point.z)
    along_z = ~along_x & ~along_y
    return type(point)(
        dr.select(along_x, dr.sign(point.x), 0),
        dr.select(along_y, dr.sign(point.y), 0),
        dr.select(along_z, dr.sign(point.z), 0),
    )
