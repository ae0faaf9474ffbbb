"""Planted fault: an offset of a centimetre, whatever the scene: contact shadows are lost."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.feelers import FEELERS
from rayproof.tracer.feeling import Hit, Start


@FEELERS.register(
    "feeler/fault_wide_offset",
    covers=("LIT-5",),
    kind="fault",
    stage=Stage.VISIBILITY,
    doubles=False,
    epsilon=lambda clearance: clearance,
)
def fault_wide_offset(hit: Hit, cosine: Any, reach: Any) -> Start:
    """Return a start 1 cm above the surface."""
    return Start(origin=dr.fma(hit.normal, 0.01, hit.position))
