"""The bound of a hit point's distance from its surface [m], and the scenes that are beyond a precision.

The bound of the distance between a computed hit point and the true surface, along the surface's normal [m].

Let S = abs(eye) + t + extent, where `extent` bounds the distance from the world's origin and the size of the shape, or
of the mesh's face, that is hit. The point fl(eye + t d) is off by one rounding, at most u S. The error of t of a
backward stable formula is a small multiple of u S / abs(dot(n, d)), and multiplied by abs(dot(n, d)) that
is again a small multiple of u S along the normal, however grazing the ray. Counting the roundings of plane and cube
(subtract, three fused products, one division: gamma(5) of o and of t d) and adding those of the shadow ray's own
intersection test gives 12 u S; the sphere's measured worst error is of the same size. FACTOR rounds up.

Two things multiply it (`TracedShape.spreads`): the transform of a curved surface, by at most norm(abs(A^-1)) norm(A),
and a slender triangle, by the product of two edges over twice its area.

Scenes whose squared lengths overflow or underflow in a precision are refused. An overflow within a formula is counted
as its error, but in such a scene every stage would silently be a miss or NaN, whatever the formula.
"""

import math
from collections.abc import Iterator
from functools import lru_cache
from typing import Any

import numpy as np

from rayproof.cases.rounding import UNIT_ROUNDOFF
from rayproof.cases.scene import Scene, Shape
from rayproof.tracer.shapes.primitives import traced

FACTOR, WIDEST = 16.0, 5 * math.sqrt(3)


def bound(*, scale: Any, spread: Any, precision: str) -> Any:
    """Return a bound on the clearance [m] anywhere in a scene whose largest absolute coordinate is `scale` [m].

    A point is within sqrt(3) scale of the world's origin, and two points are within twice that of each other, so that
    the sum of abs(eye), t and extent (a distance plus a size) is at most 5 sqrt(3) scale.
    """
    return clearance(WIDEST * scale, spread=spread, precision=precision)


def clearance(scale: Any, *, spread: Any, precision: str) -> Any:
    """Return FACTOR u spread scale [m]; `scale` is S [m]."""
    return scale * (FACTOR * UNIT_ROUNDOFF[precision]) * spread


@lru_cache(maxsize=32)  # a scene is rendered by one configuration after another
def extent(shape: Shape) -> float:
    """Return a bound on distance from the world's origin plus size [m]; of a plane, of its own origin only."""
    return float(traced(shape).reaches().max())


# The quadratic's 4 A C takes the square of a difference of two points, at most 48 L^2 for coordinates up to L, which
# must stay below 2^128 (2^1024). The same from the other end: 1 / L^2 and L^2 / 48 must not be subnormal.
LARGEST = {"float32": 2.0**60, "float64": 2.0**508}  # m


def beyond(scene: Scene, precision: str) -> str | None:
    """Return a sentence about a number of the scene that `precision` cannot represent, or None."""
    greatest = float(np.finfo(precision).max)
    for name, value in _numbers(scene):
        if abs(value) > greatest:
            return f"{name} is {value:g}, which {precision} cannot hold (at most {greatest:.3g})"
    camera, largest = scene.camera, LARGEST[precision]
    if max(map(abs, camera.up)) < float(np.finfo(precision).tiny):
        return f"up is {camera.up}: {precision} cannot tell it from zero"
    points = (camera.eye, camera.target, camera.up)
    eye, target, up = (np.asarray(point, dtype=precision).astype(np.longdouble) for point in points)
    if np.array_equal(eye, target):
        return f"{precision} cannot tell the target {camera.target} m from the eye"
    if not np.any(np.cross(target - eye, up)):
        return f"up is {camera.up}: {precision} cannot tell it from the direction of view"
    sizes = {"the eye": math.hypot(*camera.eye), "the target": math.hypot(*camera.target)}
    # A plane has a position but no size. A number that overflows float64 becomes infinite, and so is too large.
    with np.errstate(over="ignore"):
        sizes |= {
            f"shape {index}": math.hypot(*(row[3] for row in shape.to_world))
            if traced(shape).endless
            else extent(shape)
            for index, shape in enumerate(scene.shapes)
        }
    where = max(sizes, key=lambda name: sizes[name])
    length = sizes[where]
    if length > largest:
        return f"{where} reaches {length:.3g} m; the squares of lengths beyond {largest:.3g} m overflow {precision}"
    if length < 1 / largest:
        return f"nothing in the scene is larger than {length:.3g} m; squares of that vanish in {precision}"
    return None


def _numbers(scene: Scene) -> Iterator[tuple[str, float]]:
    """Yield the scene's other numbers by name: any of them may be as large as the precision allows."""
    yield "far", scene.camera.far
    for name in ("eye", "target", "up"):
        yield from ((name, value) for value in getattr(scene.camera, name))
    for index, shape in enumerate(scene.shapes):
        yield from ((f"shape {index}'s albedo", value) for value in shape.albedo)
        yield from ((f"shape {index}'s matrix", value) for row in shape.to_world for value in row)
    for index, light in enumerate(scene.lights):
        yield from ((f"light {index}'s flux", value) for value in light.flux)
        yield from ((f"light {index}'s position", value) for value in light.position)
