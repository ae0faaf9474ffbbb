"""No strategy against shadow acne: a control."""

from typing import Any

from rayproof.cases.stages import Stage
from rayproof.tracer.feelers import FEELERS
from rayproof.tracer.rays import Hit, Start


@FEELERS.register(
    "feeler/none",
    covers=("LIT-1",),
    kind="control",
    stage=Stage.VISIBILITY,
    known_bad="rounding puts about half of all hit points below their own surface, which then hides the light",
    doubles=False,
    epsilon=lambda clearance: 0 * clearance,
)
def none(hit: Hit, cosine: Any, reach: Any) -> Start:
    """Return the hit point as it is."""
    return Start(origin=hit.position)
