"""A sphere's normal in object space."""

from typing import Any

from rayproof.cases.stages import Stage
from rayproof.tracer.normals import NORMALS
from rayproof.tracer.numerics.unit_vectors import normalized


@NORMALS.register("sphere_normal/from_center", covers=("NRM-1",), kind="right", stage=Stage.NORMAL, default=True)
def from_center(point: Any, center: Any) -> Any:
    """Return normalize(point - center)."""
    return normalized(point - center)
