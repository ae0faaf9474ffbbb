"""A cube's normal in object space: sign and axis of the coordinate of greatest magnitude."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.normals import NORMALS


@NORMALS.register("cube_normal/greatest", covers=("NRM-2",), kind="right", stage=Stage.NORMAL, default=True)
def greatest(point: Any) -> Any:
    """Return the outward axis; at a tie x goes before y and y before z (erratum E8)."""
    x, y, z = abs(point.x), abs(point.y), abs(point.z)
    along_x = (x >= y) & (x >= z)
    along_y = ~along_x & (y >= z)
    along_z = ~along_x & ~along_y
    return type(point)(
        dr.select(along_x, dr.sign(point.x), 0),
        dr.select(along_y, dr.sign(point.y), 0),
        dr.select(along_z, dr.sign(point.z), 0),
    )
