"""Against shadow acne: start the feeler a few float spacings above the surface, along its normal.

The clearance bounds the distance along the normal between the computed and the true surface
(`tracer.shapes.error_bounds`).
Sources: Pharr, Jakob and Humphreys, "Physically Based Rendering", 3rd ed., section 3.9; Wächter and Binder, "A Fast
and Robust Method for Avoiding Self-Intersection", Ray Tracing Gems (2019), chapter 6.
"""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.feelers import FEELERS
from rayproof.tracer.rays import Hit, Start


@FEELERS.register(
    "feeler/normal_offset",
    covers=("LIT-5",),
    kind="right",
    stage=Stage.VISIBILITY,
    default=True,
    doubles=False,
    epsilon=lambda clearance: clearance,
)
def normal_offset(hit: Hit, cosine: Any, reach: Any) -> Start:
    """Return a start moved by the clearance [m] to the side that the normal, and so the light, is on."""
    return Start(origin=dr.fma(hit.normal, hit.clearance, hit.position))
