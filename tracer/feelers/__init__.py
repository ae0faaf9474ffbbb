"""Light feelers: they say whether the segment from a point to a light is free.

Contract, with the facts listed in `tracer.camera`:

    horizon(cosine)                -> where the light is not above the surface's horizon
    segment(origin, light)         -> (direction, end): the feeler origin + t direction is tested for t < end
    obstructed(distance)           -> where a feeler that met something at t (inf: nothing) is blocked
    feeler(hit, cosine, reach)     -> `tracer.feeling.Start`, the strategy against shadow acne. `hit` is
                                      `tracer.feeling.Hit`; cosine = dot(N, L), reach = distance to the light [m].
                                      Facts: doubles (compute the feeler and its start in float64) and
                                      epsilon(clearance) -> how far from the surface [m], along its normal, a blocker
                                      may stand without being noticed; moved(scale, precision), where it goes by
                                      something else than the clearance, how much farther [m]; scale is the largest
                                      absolute coordinate [m].
"""

from collections.abc import Callable
from typing import Any

from cases.registry import Registry
from tracer.clearance import bound

FEELERS: Registry[Callable[..., Any]] = Registry("feeler formula", package="tracer.feelers")


def shadow_epsilon(configuration: Any, *, scale: Any, spread: Any = 1.0) -> Any:
    """Return how far from a surface [m] a blocker may stand unnoticed, by the configuration's strategy.

    `scale` is the largest absolute coordinate of the scene [m]; `spread` the largest `tracer.clearance.spread` of its
    shapes; both may be arrays. It is a bound for the whole image; the strategies use each pixel's own, smaller
    clearance.
    """
    strategy = configuration.formula("feeler")
    precision = "float64" if strategy.facts["doubles"] else configuration.precision
    epsilon = strategy.facts["epsilon"](bound(scale=scale, spread=spread, precision=precision))
    moved = strategy.facts.get("moved")
    return epsilon if moved is None else epsilon + moved(scale, precision)
