"""Against shadow acne: doubles, for the hit point and for the feeler.

The rounding error of a hit point does not vanish, it shrinks by 2^29; so the feeler still begins at a minimum t, as
small as doubles allow.
"""

from typing import Any

from rayproof.cases.stages import Stage
from rayproof.tracer.feelers import FEELERS
from rayproof.tracer.rays import Hit, Start


@FEELERS.register(
    "feeler/doubles",
    covers=("LIT-4",),
    kind="right",
    stage=Stage.VISIBILITY,
    doubles=True,
    epsilon=lambda clearance: clearance,
)
def doubles(hit: Hit, cosine: Any, reach: Any) -> Start:
    """Return the hit point, found again in float64, and its clearance as a share of the way to the light."""
    return Start(origin=hit.position, nearest=hit.clearance / (cosine * reach))
