"""A normal to world space by the model matrix itself, as if it were a direction: a control."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.normals import NORMALS
from rayproof.tracer.shapes.transforms import Transform


@NORMALS.register(
    "world_normal/model_matrix",
    covers=("NRM-3",),
    kind="control",
    stage=Stage.NORMAL,
    known_bad="right for rotations and uniform scales alone",
)
def model_matrix(normal: Any, transform: Transform) -> Any:
    """Return the 3x3 part times the normal, renormalised."""
    return dr.normalize(transform.vector_to_world(normal))
