"""Shading: from flux to radiance, per channel.

Contract, with the facts listed in `tracer.camera`. `cosine` is dot(N, L), which may be negative:

    cosine(normal, away)             -> dot(N, L) for the vector [m] to the light; 0 for a light exactly at the point
    falloff(flux, squared_distance)  -> irradiance [W/m^2] on a surface that faces the light; with the fact by="away" it
                                        gets the vector [m] to the light instead
    lambert(irradiance, cosine)      -> irradiance on the tilted surface
    simplified(flux, cosine)         -> the lecture's simplified point light
    sum_lights(contributions)        -> the sum over a non-empty list of lights
    exitance(albedo, irradiance)     -> [W/m^2]
    radiance(exitance)               -> [W/(m^2 sr)]
    radiance_simplified(exitance)    -> likewise in the simplified model
    hidden(normal, direction)        -> where a one-sided surface shows its back to the viewer
"""

from collections.abc import Callable
from typing import Any

from rayproof.cases.declarations import DeclaredRegistry

SHADING: DeclaredRegistry[Callable[..., Any]] = DeclaredRegistry(
    "shading formula", package="rayproof.tracer.shading", name="SHADING"
)
