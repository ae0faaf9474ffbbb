"""Planted mistakes of the start and the end of shadow rays, and of their blockers."""

from typing import Any

import drjit as dr

from rayproof.tracer.rays import Hit, Start


def fault_bare(hit: Hit, cosine: Any, reach: Any) -> Start:
    """Return the hit point as it is.

    No strategy against shadow acne.
    """
    return Start(origin=hit.position)


def fault_inward(hit: Hit, cosine: Any, reach: Any) -> Start:
    """Return a start below the surface.

    The offset to the wrong side of the surface.
    """
    return Start(origin=dr.fma(hit.normal, -hit.clearance, hit.position))


def fault_wide_offset(hit: Hit, cosine: Any, reach: Any) -> Start:
    """Return a start 1 cm above the surface.

    An offset of a centimetre, whatever the scene: contact shadows are lost.
    """
    return Start(origin=dr.fma(hit.normal, 0.01, hit.position))


def fault_never(cosine: Any) -> Any:
    """Return False everywhere.

    Lights below the horizon counted as seen.
    """
    return (cosine < 0) & (cosine > 0)


def fault_reversed(cosine: Any) -> Any:
    """Return the mask of lights above the horizon.

    The horizon's sign turned round.
    """
    return cosine > 0


def fault_nearer_than_light(distance: Any) -> Any:
    """Return the mask of hits before the middle of the shadow ray.

    A hit counted only in the first half of the way to the light.
    """
    return distance < 0.5


def fault_obstructed_never(distance: Any) -> Any:
    """Return False everywhere.

    The shadow ray missing: every light above the horizon is seen.
    """
    return (distance < 0) & (distance > 0)


def fault_long(origin: Any, light: Any) -> tuple[Any, Any]:
    """Return the direction light - origin, and an end of 1.15; the light is at t = 1.

    Shadow rays that end behind the light, at 1.15 of the way.
    """
    return light - origin, 1.15


def fault_short(origin: Any, light: Any) -> tuple[Any, Any]:
    """Return the direction light - origin, and an end of 0.9; the light is at t = 1.

    Shadow rays that end before the light, at 0.9 of the way.
    """
    return light - origin, 0.9
