"""How far from a surface a blocker may stand without being noticed: what the strategy against acne costs."""

from typing import Any

from rayproof.tracer.configuration import Configuration
from rayproof.tracer.shapes.error_bounds import bound


def shadow_epsilon(configuration: Configuration, *, scale: Any, spread: Any = 1.0) -> Any:
    """Return how far from a surface [m] a blocker may stand unnoticed, by the configuration's strategy.

    `scale` is the largest absolute coordinate of the scene [m]; `spread` the largest of its shapes'
    `TracedShape.spreads`; both may be arrays. It is a bound for the whole image; the strategies use each pixel's own,
    smaller clearance.
    """
    strategy = configuration.formula("feeler")
    precision = "float64" if strategy.facts.get("doubles", False) else configuration.precision
    epsilon = strategy.facts.get("clearances", 1) * bound(scale=scale, spread=spread, precision=precision)
    moved = strategy.facts.get("moved")
    return epsilon if moved is None else epsilon + moved(scale, precision)
