"""Planted fault: no strategy against shadow acne."""

from typing import Any

from rayproof.cases.stages import Stage
from rayproof.tracer.feelers import FEELERS
from rayproof.tracer.feeling import Hit, Start


@FEELERS.register(
    "feeler/fault_bare",
    covers=("LIT-5",),
    kind="fault",
    stage=Stage.VISIBILITY,
    doubles=False,
    epsilon=lambda clearance: clearance,
)
def fault_bare(hit: Hit, cosine: Any, reach: Any) -> Start:
    """Return the hit point as it is."""
    return Start(origin=hit.position)
