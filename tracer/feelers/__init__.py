"""Light feelers: they say whether the segment from a point to a light is free.

Contract, with the facts listed in `tracer.camera`:

    horizon(cosine)                -> where the light is not above the surface's horizon
    segment(origin, light)         -> (direction, end): the feeler origin + t direction is tested for t < end
    obstructed(distance)           -> where a feeler that met something at t (inf: nothing) is blocked
    feeler(hit, cosine, reach)     -> `tracer.rays.Start`, the strategy against shadow acne. `hit` is
                                      `tracer.rays.Hit`; cosine = dot(N, L), reach = distance to the light [m].
                                      Facts: doubles (compute the feeler and its start in float64) and
                                      epsilon(clearance) -> how far from the surface [m], along its normal, a blocker
                                      may stand without being noticed; moved(scale, precision), where it goes by
                                      something else than the clearance, how much farther [m]; scale is the largest
                                      absolute coordinate [m].
"""

from collections.abc import Callable
from typing import Any

from rayproof.cases.declarations import DeclaredRegistry

FEELERS: DeclaredRegistry[Callable[..., Any]] = DeclaredRegistry(
    "feeler formula", package="rayproof.tracer.feelers", name="FEELERS"
)
