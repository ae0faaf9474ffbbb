"""Against shadow acne: up to 256 float spacings along each axis of the normal, a control for points off their surface.

Made for hit points that are computed from barycentric coordinates; points o + t d far from the eye lie farther off.
Source: Wächter and Binder, "A Fast and Robust Method for Avoiding Self-Intersection", Ray Tracing Gems (2019),
chapter 6. For float64 their constants for float32 are taken down by 2^29.
"""

from typing import Any

import drjit as dr

from rayproof.cases.rounding import UNIT_ROUNDOFF
from rayproof.cases.stages import Stage
from rayproof.tracer.feelers import FEELERS
from rayproof.tracer.numerics.ulps import moved_by_ulps
from rayproof.tracer.rays import Hit, Start

NEAR_ORIGIN = 1 / 32  # m, below which spacings are too small
OFFSET = 1 / 65536  # m, of the normal there
SPACINGS = 256.0


@FEELERS.register(
    "feeler/waechter_binder",
    covers=("LIT-5",),
    kind="control",
    stage=Stage.VISIBILITY,
    known_bad="256 spacings of the hit point are fewer than the error of o + t d on grazing or far hits",
    doubles=False,
    epsilon=lambda clearance: clearance,
    moved=lambda scale, precision: UNIT_ROUNDOFF[precision] * (512 * scale + 256),
)
def waechter_binder(hit: Hit, cosine: Any, reach: Any) -> Start:
    """Return a start moved by int(256 N) float spacings, or by N / 65536 [m] near the origin."""
    wide = dr.type_v(hit.position) == dr.VarType.Float64
    offset = OFFSET * (2.0**-29 if wide else 1.0)

    def component(p: Any, n: Any) -> Any:
        return dr.select(abs(p) < NEAR_ORIGIN, dr.fma(n, offset, p), moved_by_ulps(p, dr.trunc(SPACINGS * n)))

    return Start(origin=type(hit.position)(*(component(p, n) for p, n in zip(hit.position, hit.normal, strict=True))))
