"""Planted fault: the offset to the wrong side of the surface."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.feelers import FEELERS
from rayproof.tracer.feeling import Hit, Start


@FEELERS.register(
    "feeler/fault_inward",
    covers=("LIT-5",),
    kind="fault",
    says="starts its shadow rays below the surface",
    stage=Stage.VISIBILITY,
    doubles=False,
    epsilon=lambda clearance: clearance,
)
def fault_inward(hit: Hit, cosine: Any, reach: Any) -> Start:
    """Return a start below the surface."""
    return Start(origin=dr.fma(hit.normal, -hit.clearance, hit.position))
