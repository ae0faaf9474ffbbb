"""Planted fault: the sign of the cube's normal lost."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.normals import NORMALS


@NORMALS.register("cube_normal/fault_unsigned", covers=("NRM-2",), kind="fault", stage=Stage.NORMAL)
def fault_unsigned(point: Any) -> Any:
    """Return the axis of the greatest coordinate, always positive."""
    x, y, z = abs(point.x), abs(point.y), abs(point.z)
    along_x = (x >= y) & (x >= z)
    along_y = ~along_x & (y >= z)
    return type(point)(dr.select(along_x, 1.0, 0), dr.select(along_y, 1.0, 0), dr.select(along_x | along_y, 0, 1.0))
