"""The shading normal of a two-sided surface."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.normals import NORMALS


@NORMALS.register("facing/viewer", covers=("NRM-3",), kind="right", stage=Stage.NORMAL, default=True)
def viewer(normal: Any, direction: Any) -> Any:
    """Return the normal turned against `direction`."""
    return dr.select(dr.dot(normal, direction) > 0, -normal, normal)
