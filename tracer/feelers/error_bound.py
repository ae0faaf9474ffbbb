"""Against shadow acne: leave the box that bounds the hit point's error along the normal, then round outwards.

Per axis the error of o + t d is abs(d) dt + gamma(2) (abs(o) + abs(t d)); dt is half the clearance over abs(N . d),
what rounding may do to t at this angle. The box does not know that the first part lies along d: the offset grows as
1 / cos at grazing views, where `feeler/normal_offset` keeps to the part along the normal.
Source: Pharr, Jakob and Humphreys, "Physically Based Rendering", 4th ed. (2023), section 6.8.6, and pbrt-v4's ray.h,
OffsetRayOrigin.
"""

from typing import Any

import drjit as dr

from rayproof.cases.rounding import gamma
from rayproof.cases.stages import Stage
from rayproof.tracer.feelers import FEELERS
from rayproof.tracer.numerics.ulps import next_towards
from rayproof.tracer.rays import Hit, Start


@FEELERS.register(
    "feeler/error_bound",
    covers=("LIT-5",),
    kind="right",
    stage=Stage.VISIBILITY,
    doubles=False,
    epsilon=lambda clearance: 4 * clearance,
)
def error_bound(hit: Hit, cosine: Any, reach: Any) -> Start:
    """Return a start moved by dot(abs(N), error) [m] along N, each component then rounded away from the surface."""
    precision = "float64" if dr.type_v(hit.position) == dr.VarType.Float64 else "float32"
    N, d = hit.normal, hit.ray.direction
    error_of_t = hit.clearance / (2 * abs(dr.dot(N, d)))
    error = abs(d) * error_of_t + gamma(2, precision=precision) * (abs(hit.ray.origin) + abs(d * hit.distance))
    offset = N * dr.dot(abs(N), error)
    moved = hit.position + offset
    return Start(origin=type(moved)(*(next_towards(x, way) for x, way in zip(moved, offset, strict=True))))
