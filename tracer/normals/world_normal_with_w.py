"""Control for erratum E13: the fault that a translation makes when w enters the normalisation."""

from typing import Any

import drjit as dr
import numpy as np

from rayproof.cases.stages import Stage
from rayproof.tracer.normals import NORMALS
from rayproof.tracer.numerics.matrices import quad
from rayproof.tracer.shapes.transforms import Transform


@NORMALS.register(
    "world_normal/with_w",
    covers=("NRM-3",),
    kind="control",
    says="normalises normals with their fourth component, so that a translation makes them too short",
    stage=Stage.NORMAL,
    erratum="E13",
)
def with_w(normal: Any, transform: Transform) -> Any:
    """Return xyz of the normalised 4-vector, which is too short wherever the matrix translates."""
    rows = np.linalg.inv(np.asarray(transform.to_world)).T
    x, y, z, w = (sum(float(c) * n for c, n in zip(row, normal, strict=False)) for row in rows)
    return dr.normalize(quad(x, y, z, w)).xyz
