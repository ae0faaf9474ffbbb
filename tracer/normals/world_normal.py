"""A normal to world space by the inverse transpose of the model matrix's 3x3 part."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.normals import NORMALS
from rayproof.tracer.shapes.transforms import Transform


@NORMALS.register(
    "world_normal/inverse_transpose", covers=("NRM-3", "XF-2"), kind="right", stage=Stage.NORMAL, default=True
)
def inverse_transpose(normal: Any, transform: Transform) -> Any:
    """Return the renormalised world normal."""
    return dr.normalize(transform.normal_to_world(normal))
