"""Planted fault: point minus centre left as long as the radius."""

from typing import Any

from rayproof.cases.stages import Stage
from rayproof.tracer.normals import NORMALS


@NORMALS.register(
    "sphere_normal/fault_unnormalised",
    covers=("NRM-1",),
    kind="fault",
    says="does not divide the sphere's normal by its radius",
    stage=Stage.NORMAL,
)
def fault_unnormalised(point: Any, center: Any) -> Any:
    """Return point - center."""
    return point - center
