"""A sphere's normal in object space."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.normals import NORMALS


@NORMALS.register("sphere_normal/from_center", covers=("NRM-1",), kind="right", stage=Stage.NORMAL, default=True)
def from_center(point: Any, center: Any) -> Any:
    """Return normalize(point - center)."""
    return dr.normalize(point - center)
