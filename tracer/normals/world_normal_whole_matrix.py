"""Control for erratum E13: the 4x4 matrix, translation included, inverted and transposed."""

from typing import Any

import drjit as dr
import numpy as np

from rayproof.cases.stages import Stage
from rayproof.tracer.normals import NORMALS
from rayproof.tracer.shapes.transforms import Transform


@NORMALS.register(
    "world_normal/whole_matrix",
    covers=("NRM-3",),
    kind="control",
    stage=Stage.NORMAL,
    erratum="E13",
    equivalent="the inverse transpose of an affine 4x4 matrix has the 3x3 part's inverse transpose as its xyz block, "
    "and w = 0",
)
def whole_matrix(normal: Any, transform: Transform) -> Any:
    """Return xyz of the 4x4 inverse transpose times (n, 0), normalised as a 3-vector."""
    rows = np.linalg.inv(np.asarray(transform.to_world)).T
    return dr.normalize(
        type(normal)(*(sum(float(c) * n for c, n in zip(row, normal, strict=False)) for row in rows[:3]))
    )
