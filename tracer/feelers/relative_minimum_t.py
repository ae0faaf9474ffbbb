"""Against shadow acne: a minimum t in proportion to coordinates and viewing distance, a control.

It grows with the scene, but knows neither the angle of the surface nor how little of a far scene's coordinates is size.
"""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.feelers import FEELERS
from rayproof.tracer.rays import Hit, Start

SHARE = 1e-4


@FEELERS.register(
    "feeler/relative_minimum_t",
    covers=("LIT-3",),
    kind="control",
    stage=Stage.VISIBILITY,
    known_bad="too short towards the terminator, and longer than what stands close in scenes far from the origin",
    doubles=False,
    epsilon=lambda clearance: clearance,
    moved=lambda scale, precision: 4 * SHARE * scale,
)
def relative_minimum_t(hit: Hit, cosine: Any, reach: Any) -> Start:
    """Return the hit point, and 1e-4 of max(abs(p), t) as a share of the way to the light."""
    size = dr.maximum(dr.max(abs(hit.position)), hit.distance)
    return Start(origin=hit.position, nearest=SHARE * size / reach)
