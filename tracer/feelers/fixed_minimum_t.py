"""Against shadow acne: the same minimum t [m] everywhere, a control.

Source: Shirley, "Ray Tracing in One Weekend" (2016 and later), on shadow acne.
"""

from typing import Any

from rayproof.cases.stages import Stage
from rayproof.tracer.feelers import FEELERS
from rayproof.tracer.rays import Hit, Start

MINIMUM = 1e-3  # m


@FEELERS.register(
    "feeler/fixed_minimum_t",
    covers=("LIT-3",),
    kind="control",
    stage=Stage.VISIBILITY,
    known_bad="one length for every scale: too short from 100 m on, and longer than what stands close in small scenes",
    doubles=False,
    epsilon=lambda clearance: clearance,
    moved=lambda scale, precision: MINIMUM,
)
def fixed_minimum_t(hit: Hit, cosine: Any, reach: Any) -> Start:
    """Return the hit point, and 1 mm as a share of the way to the light."""
    return Start(origin=hit.position, nearest=MINIMUM / reach)
