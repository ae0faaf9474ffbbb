"""Against shadow acne as Mitsuba 3 does: an offset along the normal by the size of the coordinates, and a shorter end.

The 1 in 1 + max(abs(p)) is a metre: in small scenes the offset is longer than what stands close.
Source: Mitsuba 3, include/mitsuba/render/interaction.h, offset_p and spawn_ray_to; RayEpsilon is 1500 unit roundoffs
and ShadowEpsilon ten times that.
"""

from typing import Any

import drjit as dr

from rayproof.cases.rounding import UNIT_ROUNDOFF
from rayproof.cases.stages import Stage
from rayproof.tracer.feelers import FEELERS
from rayproof.tracer.rays import Hit, Start

RAY_EPSILON = 1500.0  # unit roundoffs
SHADOW_EPSILON = 15000.0


def _roundoff(array: Any) -> float:
    return UNIT_ROUNDOFF["float64" if dr.type_v(array) == dr.VarType.Float64 else "float32"]


@FEELERS.register(
    "feeler/mitsuba",
    covers=("LIT-5",),
    kind="right",
    stage=Stage.VISIBILITY,
    doubles=False,
    epsilon=lambda clearance: clearance,
    moved=lambda scale, precision: RAY_EPSILON * UNIT_ROUNDOFF[precision] * (1 + scale),
)
def mitsuba(hit: Hit, cosine: Any, reach: Any) -> Start:
    """Return a start moved by (1 + max(abs(p))) RayEpsilon [m] along the normal, and ShadowEpsilon off the end."""
    u = _roundoff(hit.position)
    offset = (1 + dr.max(abs(hit.position))) * (RAY_EPSILON * u)
    return Start(origin=dr.fma(hit.normal, offset, hit.position), shorter=SHADOW_EPSILON * u)
