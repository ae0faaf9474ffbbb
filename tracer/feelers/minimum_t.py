"""Against shadow acne: a minimum t.

A good value depends on scale, on distance and on the angle: this one clears the surface by the clearance along its
normal, so it grows towards the terminator, where blockers close to the surface are lost.
"""

from typing import Any

from rayproof.cases.stages import Stage
from rayproof.tracer.feelers import FEELERS
from rayproof.tracer.rays import Hit, Start


@FEELERS.register(
    "feeler/minimum_t",
    covers=("LIT-3",),
    kind="right",
    stage=Stage.VISIBILITY,
    doubles=False,
    epsilon=lambda clearance: clearance,
)
def minimum_t(hit: Hit, cosine: Any, reach: Any) -> Start:
    """Return the hit point and clearance / dot(N, L), as a share of the way to the light."""
    return Start(origin=hit.position, nearest=hit.clearance / (cosine * reach))
