"""Against shadow acne: the same offset along the normal [m] everywhere, a control."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.feelers import FEELERS
from rayproof.tracer.rays import Hit, Start

OFFSET = 1e-4  # m


@FEELERS.register(
    "feeler/fixed_offset",
    covers=("LIT-5",),
    kind="control",
    stage=Stage.VISIBILITY,
    known_bad="one length for every scale: too short from 1 km on, and more than the whole of a small scene",
    doubles=False,
    epsilon=lambda clearance: clearance,
    moved=lambda scale, precision: OFFSET,
)
def fixed_offset(hit: Hit, cosine: Any, reach: Any) -> Start:
    """Return a start moved by 0.1 mm along the normal."""
    return Start(origin=dr.fma(hit.normal, OFFSET, hit.position))
