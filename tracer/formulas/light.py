"""Formulas of light: falloff, cosine, irradiance, exitance, radiance, and which side is lit (RAD-1 to RAD-5)."""

from typing import Any

import drjit as dr


def direct(normal: Any, away: Any) -> Any:
    """Return dot(N, away) / abs(away); the falloff needs 1 / abs(away)^2 as well.

    The cosine between a surface's normal and the way to a light.
    """
    squared = dr.squared_norm(away)
    # 0 times infinity for a light exactly at the point, where irradiance is defined to be 0.
    return dr.select(squared == 0, 0, dr.dot(normal, away) * dr.sqrt(1 / squared))


def cosine_scaled(normal: Any, away: Any) -> Any:
    """Return dot(N, L) with L = away / m over its length, m the largest absolute component.

    The cosine between a surface's normal and the way to a light, scaled first so that no
    square over- or underflows.
    Source: Blue, "A Portable Fortran Program to Find the Euclidean Norm of a Vector", ACM Transactions on Mathematical
    Software 4 (1978), for the norm.
    """
    largest = dr.max(abs(away))
    there = largest == 0
    L = away / dr.select(there, 1, largest)
    return dr.select(there, 0, dr.dot(normal, L) / dr.norm(L))


def inverse_square(flux: Any, squared_distance: Any) -> Any:
    """Return Phi / (4 pi r^2) [W/m^2].

    Irradiance of an isotropic point light on a surface that faces it: flux over the sphere's area.
    """
    return flux / (4 * dr.pi) / squared_distance


def no_falloff(flux: Any, squared_distance: Any) -> Any:
    """Return the flux as it is, without 4 pi r^2.

    Control for erratum E9: the clamped cosine as the only factor in "the amount of light" of a point light.
    """
    return flux


def falloff_scaled(flux: Any, away: Any) -> Any:
    """Return Phi / (4 pi) / r / r [W/m^2] with r = m abs(away / m), m the largest absolute component [m].

    Irradiance of an isotropic point light by its distance, twice divided by, so that no square over- or underflows.
    Source: Blue, "A Portable Fortran Program to Find the Euclidean Norm of a Vector", ACM Transactions on Mathematical
    Software 4 (1978), for the norm.
    """
    largest = dr.max(abs(away))
    r = largest * dr.norm(away / dr.select(largest == 0, 1, largest))
    return flux / (4 * dr.pi) / r / r


def cosine_law(irradiance: Any, cosine: Any) -> Any:
    """Return E dot(N, L), zero below the horizon. A NaN stays one.

    Lambert's cosine law.
    """
    return dr.select(cosine <= 0, 0, irradiance * cosine)


def clamped_cosine(flux: Any, cosine: Any) -> Any:
    """Return RGB clamp(dot(N, L), 0, 1). A NaN stays one.

    The lecture's simplified point light: its colour and a clamped cosine, without falloff.
    """
    return flux * dr.select(cosine <= 0, 0, dr.select(cosine > 1, 1, cosine))


def every(contributions: list[Any]) -> Any:
    """Return the sum of all contributions.

    Lights add: rays do not interact.
    """
    total = contributions[0]
    for contribution in contributions[1:]:
        total = total + contribution
    return total


def exitance(albedo: Any, irradiance: Any) -> Any:
    """Return M = rho E [W/m^2].

    Radiant exitance of a diffuse surface.
    """
    return albedo * irradiance


def diffuse(exitance: Any) -> Any:
    """Return L = M / pi [W/(m^2 sr)].

    Radiance of a diffuse surface, the same in all directions and along the whole ray.
    """
    return exitance / dr.pi


def same(exitance: Any) -> Any:
    """Return the exitance as it is: the model has no 1/pi.

    Radiance in the lecture's simplified model.
    """
    return exitance


def back(normal: Any, direction: Any) -> Any:
    """Return the mask of viewers behind the surface. A NaN is not behind: it must stay visible as a NaN.

    The dark back of a one-sided surface.
    """
    return dr.dot(normal, direction) >= 0
