"""Control for erratum E17: "normalize the point of intersection", a point and not a vector from the centre."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.normals import NORMALS


@NORMALS.register("sphere_normal/center_kept", covers=("NRM-1",), kind="control", stage=Stage.NORMAL, erratum="E17")
def center_kept(point: Any, center: Any) -> Any:
    """Return normalize(point), right only for a centre at the origin."""
    return dr.normalize(point)
