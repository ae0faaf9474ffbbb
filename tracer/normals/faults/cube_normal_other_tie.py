"""Planted fault: a tie on an edge decided z before y before x (erratum E8)."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.normals import NORMALS


@NORMALS.register(
    "cube_normal/fault_other_tie",
    covers=("NRM-2",),
    kind="fault",
    stage=Stage.NORMAL,
    equivalent="it differs only where two coordinates are equal, on the cube's own edges, and there the specification "
    "(E8) counts either face as right",
)
def fault_other_tie(point: Any) -> Any:
    """Return the outward axis, ties the other way round."""
    x, y, z = abs(point.x), abs(point.y), abs(point.z)
    along_z = (z >= x) & (z >= y)
    along_y = ~along_z & (y >= x)
    along_x = ~along_z & ~along_y
    return type(point)(
        dr.select(along_x, dr.sign(point.x), 0),
        dr.select(along_y, dr.sign(point.y), 0),
        dr.select(along_z, dr.sign(point.z), 0),
    )
