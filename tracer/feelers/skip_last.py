"""Against shadow acne: ignore the last object hit, which loses its shadow on itself."""

from typing import Any

from rayproof.cases.stages import Stage
from rayproof.tracer.feelers import FEELERS
from rayproof.tracer.rays import Hit, Start


@FEELERS.register(
    "feeler/skip_last",
    covers=("LIT-2",),
    kind="right",
    stage=Stage.VISIBILITY,
    doubles=False,
    epsilon=lambda clearance: clearance,
)
def skip_last(hit: Hit, cosine: Any, reach: Any) -> Start:
    """Return the hit point itself, with its shape left out of the test."""
    return Start(origin=hit.position, skip=hit.shape)
