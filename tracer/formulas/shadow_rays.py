"""Formulas of shadow rays: their direction and end, what blocks them, and strategies against shadow acne.

The strategies against shadow acne return the start of a shadow ray: first the lecture's, by a minimum t, then offsets
along the normal, by year. If a strategy uses another length than the clearance, `..._moves` returns a bound of the
additional distance [m] from the scene's largest absolute coordinate `scale` [m].
"""

from typing import Any

import drjit as dr

from rayproof.cases.rounding import UNIT_ROUNDOFF, gamma
from rayproof.tracer.kernel.arithmetic import moved_by_ulps, next_towards
from rayproof.tracer.rays import Hit, Start

FIXED_MINIMUM = 1e-3  # m
SHARE_OF_SIZE = 1e-4  # of the scene's size
FIXED_OFFSET = 1e-4  # m
# Of Wächter and Binder.
NEAR_ORIGIN = 1 / 32  # m, below which spacings are too small
OFFSET_NEAR_ORIGIN = 1 / 65536  # m, of the normal there
SPACINGS = 256.0
# Of Mitsuba, in unit roundoffs.
RAY_EPSILON = 1500.0
SHADOW_EPSILON = 15000.0


def below(cosine: Any) -> Any:
    """Return the mask of dot(N, L) <= 0. A NaN is not below: it must stay visible as a NaN.

    The lights that a surface cannot see because they are below its horizon.
    """
    return cosine <= 0


def to_light(origin: Any, light: Any) -> tuple[Any, Any]:
    """Return the direction light - origin, so that the light is at t = 1, and the end 1.

    The segment that a shadow ray tests: strictly between the point and the light.
    """
    return light - origin, 1.0


def endless(origin: Any, light: Any) -> tuple[Any, Any]:
    """Return a ray that goes on behind the light, where a blocker does not count.

    Control for erratum E10: a shadow ray "obstructed by an object", whether before or behind the light.
    """
    return light - origin, dr.inf


def any_hit(distance: Any) -> Any:
    """Return the mask of shadow rays that hit a shape: a blocked light contributes nothing.

    The meaning of a shadow ray's hit.
    """
    return distance < dr.inf


def no_strategy(hit: Hit, cosine: Any, reach: Any) -> Start:
    """Return the hit point as it is.

    No strategy against shadow acne: a control.
    """
    return Start(origin=hit.position)


def skip_last(hit: Hit, cosine: Any, reach: Any) -> Start:
    """Return the hit point itself, with its shape left out of the test.

    Ignore the last object hit, which loses its shadow on itself.
    """
    return Start(origin=hit.position, skip=hit.shape)


def minimum_t(hit: Hit, cosine: Any, reach: Any) -> Start:
    """Return the hit point and clearance / dot(N, L), as a share of the way to the light.

    A minimum t.
    A good value depends on scale, on distance and on the angle: this one clears the surface by the clearance along its
    normal, so it grows towards the terminator, where blockers close to the surface are lost.
    """
    return Start(origin=hit.position, nearest=hit.clearance / (cosine * reach))


def fixed_minimum_t(hit: Hit, cosine: Any, reach: Any) -> Start:
    """Return the hit point, and 1 mm as a share of the way to the light.

    The same minimum t [m] everywhere, a control.
    Source: Shirley, "Ray Tracing in One Weekend" (2016 and later), on shadow acne.
    """
    return Start(origin=hit.position, nearest=FIXED_MINIMUM / reach)


def fixed_minimum_t_moves(scale: float, precision: str) -> float:
    """Return the fixed minimum [m]."""
    return FIXED_MINIMUM


def relative_minimum_t(hit: Hit, cosine: Any, reach: Any) -> Start:
    """Return the hit point, and 1e-4 of max(abs(p), t) as a share of the way to the light.

    A minimum t in proportion to coordinates and viewing distance, a control.
    It grows with the scene, but ignores the angle of the surface, and that a far scene's coordinates are much larger
    than its size.
    """
    size = dr.maximum(dr.max(abs(hit.position)), hit.distance)
    return Start(origin=hit.position, nearest=SHARE_OF_SIZE * size / reach)


def relative_minimum_t_moves(scale: float, precision: str) -> float:
    """Return four shares of the scale [m]: coordinates and viewing distance are at most 2 sqrt(3) scale."""
    return 4 * SHARE_OF_SIZE * scale


def doubles(hit: Hit, cosine: Any, reach: Any) -> Start:
    """Return the hit point, found again in float64, and its clearance as a share of the way to the light.

    Doubles, for the hit point and for the shadow ray.
    The rounding error of a hit point does not vanish, it shrinks by 2^29; so the shadow ray still begins at a minimum
    t, as small as doubles allow.
    """
    return Start(origin=hit.position, nearest=hit.clearance / (cosine * reach))


def normal_offset(hit: Hit, cosine: Any, reach: Any) -> Start:
    """Return a start moved by the clearance [m] to the side that the normal, and so the light, is on.

    Start the shadow ray a few float spacings above the surface, along its normal.
    The clearance bounds the distance along the normal between the computed and the true surface
    (`tracer.shapes.bounds`).
    Sources: Pharr, Jakob and Humphreys, "Physically Based Rendering", 3rd ed., section 3.9; Wächter and Binder, "A Fast
    and Robust Method for Avoiding Self-Intersection", Ray Tracing Gems (2019), chapter 6.
    """
    return Start(origin=dr.fma(hit.normal, hit.clearance, hit.position))


def fixed_offset(hit: Hit, cosine: Any, reach: Any) -> Start:
    """Return a start moved by 0.1 mm along the normal.

    The same offset along the normal [m] everywhere, a control.
    """
    return Start(origin=dr.fma(hit.normal, FIXED_OFFSET, hit.position))


def fixed_offset_moves(scale: float, precision: str) -> float:
    """Return the fixed offset [m]."""
    return FIXED_OFFSET


def waechter_binder(hit: Hit, cosine: Any, reach: Any) -> Start:
    """Return a start moved by int(256 N) float spacings, or by N / 65536 [m] near the origin.

    Up to 256 float spacings along each axis of the normal, a control for points off their surface.
    Made for hit points that are computed from barycentric coordinates; points o + t d far from the eye lie farther off.
    Source: Wächter and Binder, "A Fast and Robust Method for Avoiding Self-Intersection", Ray Tracing Gems (2019),
    chapter 6. For float64 their constants for float32 are taken down by 2^29.
    """
    wide = dr.type_v(hit.position) == dr.VarType.Float64
    offset = OFFSET_NEAR_ORIGIN * (2.0**-29 if wide else 1.0)

    def component(p: Any, n: Any) -> Any:
        return dr.select(abs(p) < NEAR_ORIGIN, dr.fma(n, offset, p), moved_by_ulps(p, dr.trunc(SPACINGS * n)))

    return Start(origin=type(hit.position)(*(component(p, n) for p, n in zip(hit.position, hit.normal, strict=True))))


def waechter_binder_moves(scale: float, precision: str) -> float:
    """Return 256 spacings [m] of the largest coordinate, or of 1 m near the origin."""
    return UNIT_ROUNDOFF[precision] * (512 * scale + 256)


def error_bound(hit: Hit, cosine: Any, reach: Any) -> Start:
    """Return a start moved by dot(abs(N), error) [m] along N, each component then rounded away from the surface.

    Leave the box that bounds the hit point's error along the normal, then round outwards. Per axis the error of o + t d
    is abs(d) dt + gamma(2) (abs(o) + abs(t d)); dt is half the clearance over abs(N . d), the bound of t's error at
    this angle. A box ignores that the first part is parallel to d: the offset grows as 1 / cos at grazing views,
    whereas `shadow_ray/normal_offset` counts only the part along the normal.
    Source: Pharr, Jakob and Humphreys, "Physically Based Rendering", 4th ed. (2023), section 6.8.6, and pbrt-v4's
    ray.h, OffsetRayOrigin.
    """
    precision = "float64" if dr.type_v(hit.position) == dr.VarType.Float64 else "float32"
    N, d = hit.normal, hit.ray.direction
    error_of_t = hit.clearance / (2 * abs(dr.dot(N, d)))
    error = abs(d) * error_of_t + gamma(2, precision=precision) * (abs(hit.ray.origin) + abs(d * hit.distance))
    offset = N * dr.dot(abs(N), error)
    moved = hit.position + offset
    return Start(origin=type(moved)(*(next_towards(x, way) for x, way in zip(moved, offset, strict=True))))


def _roundoff(array: Any) -> float:
    return UNIT_ROUNDOFF["float64" if dr.type_v(array) == dr.VarType.Float64 else "float32"]


def mitsuba(hit: Hit, cosine: Any, reach: Any) -> Start:
    """Return a start moved by (1 + max(abs(p))) RayEpsilon [m] along the normal, and ShadowEpsilon off the end.

    As Mitsuba 3 does: an offset along the normal by the size of the coordinates, and a shorter end.
    The 1 in 1 + max(abs(p)) is a metre: in small scenes the offset exceeds the distance of near blockers.
    Source: Mitsuba 3, include/mitsuba/render/interaction.h, offset_p and spawn_ray_to; RayEpsilon is 1500 unit
    roundoffs and ShadowEpsilon ten times that.
    """
    u = _roundoff(hit.position)
    offset = (1 + dr.max(abs(hit.position))) * (RAY_EPSILON * u)
    return Start(origin=dr.fma(hit.normal, offset, hit.position), shorter=SHADOW_EPSILON * u)


def mitsuba_moves(scale: float, precision: str) -> float:
    """Return the offset [m] at the largest coordinate."""
    return RAY_EPSILON * UNIT_ROUNDOFF[precision] * (1 + scale)
