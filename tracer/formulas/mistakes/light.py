"""Planted mistakes of falloff, cosine, albedo, exitance, radiance and sums over lights."""

from typing import Any

import drjit as dr


def fault_albedo_squared(albedo: Any, irradiance: Any) -> Any:
    """Return rho^2 E.

    The albedo applied twice.
    """
    return albedo * albedo * irradiance


def fault_channels_swapped(albedo: Any, irradiance: Any) -> Any:
    """Return M in the order B, G, R.

    Red and blue swapped.
    """
    exitance = albedo * irradiance
    return type(exitance)(exitance.z, exitance.y, exitance.x)


def fault_white(albedo: Any, irradiance: Any) -> Any:
    """Return E.

    The albedo forgotten.
    """
    return irradiance + 0 * albedo


def fault_hemisphere(flux: Any, squared_distance: Any) -> Any:
    """Return Phi / (2 pi r^2).

    2 pi in place of 4 pi, as if the light shone into a hemisphere.
    """
    return flux / (2 * dr.pi) / squared_distance


def fault_inverse(flux: Any, squared_distance: Any) -> Any:
    """Return Phi / (4 pi r).

    1/r in place of 1/r^2.
    """
    return flux / (4 * dr.pi) / dr.sqrt(squared_distance)


def fault_no_four_pi(flux: Any, squared_distance: Any) -> Any:
    """Return Phi / r^2.

    4 pi missing, as if flux were intensity.
    """
    return flux / squared_distance


def fault_front(normal: Any, direction: Any) -> Any:
    """Return the mask of viewers in front of the surface.

    The front of one-sided surfaces black in place of the back.
    """
    return dr.dot(normal, direction) < 0


def fault_never(normal: Any, direction: Any) -> Any:
    """Return False everywhere.

    One-sided surfaces treated as two-sided: their backs shine.
    """
    return (dr.dot(normal, direction) < 0) & (dr.dot(normal, direction) > 0)


def fault_missing(irradiance: Any, cosine: Any) -> Any:
    """Return E as on a surface that faces the light.

    No cosine at all.
    """
    return dr.select(cosine <= 0, 0, irradiance)


def fault_squared(irradiance: Any, cosine: Any) -> Any:
    """Return E dot(N, L)^2.

    The cosine squared.
    """
    return dr.select(cosine <= 0, 0, irradiance * cosine * cosine)


def fault_unclamped(irradiance: Any, cosine: Any) -> Any:
    """Return E dot(N, L), negative below the horizon.

    The cosine not clamped below the horizon.
    """
    return irradiance * cosine


def fault_clamped(exitance: Any) -> Any:
    """Return L, at most 1.

    Radiance clamped to 1, as a display does.
    """
    return dr.minimum(exitance / dr.pi, 1.0)


def fault_no_pi(exitance: Any) -> Any:
    """Return M.

    1/pi missing.
    """
    return exitance


def fault_over_pi(exitance: Any) -> Any:
    """Return M / pi.

    The physical 1/pi in the lecture's simplified model.
    """
    return exitance / dr.pi


def fault_srgb(exitance: Any) -> Any:
    """Return L as a display would get it.

    The sRGB transfer curve applied to linear radiance.
    """
    linear: Any = exitance / dr.pi
    curved: Any = dr.power(linear, 1 / 2.4)
    return dr.select(linear <= 0.0031308, 12.92 * linear, 1.055 * curved - 0.055)


def fault_over_four_pi(flux: Any, cosine: Any) -> Any:
    """Return RGB cos / (4 pi).

    The light's RGB taken for a flux and spread over the sphere.
    """
    return flux / (4 * dr.pi) * dr.select(cosine <= 0, 0, cosine)


def fault_simplified_unclamped(flux: Any, cosine: Any) -> Any:
    """Return RGB dot(N, L).

    The simplified model's cosine not clamped.
    """
    return flux * cosine


def fault_sum_lights_clamped(contributions: list[Any]) -> Any:
    """Return the sum, at most 1.

    The sum of lights clamped to 1.
    """
    total = contributions[0]
    for contribution in contributions[1:]:
        total = total + contribution
    return dr.minimum(total, 1.0)


def fault_last_dropped(contributions: list[Any]) -> Any:
    """Return the sum without the last of several lights.

    One light dropped.
    """
    total = contributions[0]
    for contribution in contributions[1:-1]:
        total = total + contribution
    return total


def fault_mean(contributions: list[Any]) -> Any:
    """Return the mean contribution.

    The mean of the lights in place of their sum.
    """
    total = contributions[0]
    for contribution in contributions[1:]:
        total = total + contribution
    return total / len(contributions)
