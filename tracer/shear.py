"""The shear that turns a ray into the z axis: triangles are then decided in two dimensions, by signs alone.

Source: Woop, Benthin and Wald, "Watertight Ray/Triangle Intersection", Journal of Computer Graphics Techniques 2
(2013). The same corner is sheared to the same numbers in every triangle that shares it; each product and sum is an
explicit operation, because a compiler that fused some of them would tear the edges open.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import drjit as dr

from tracer.rays import Interval, Ray


@dataclass(frozen=True, kw_only=True)
class Sheared:
    """A triangle's corners A, B, C beside the ray: x and y across it, z along it [m]."""

    A: Any
    B: Any
    C: Any


def _turned(vector: Any, x_largest: Any, y_largest: Any) -> Any:
    """Return the components in cyclic order with the ray's largest last, which keeps the winding."""
    x, y, z = vector.x, vector.y, vector.z
    return type(vector)(
        dr.select(x_largest, y, dr.select(y_largest, z, x)),
        dr.select(x_largest, z, dr.select(y_largest, x, y)),
        dr.select(x_largest, x, dr.select(y_largest, y, z)),
    )


def shear(ray: Ray, triangle: Any) -> Sheared:
    """Return the triangle in the ray's own coordinates; z is t."""
    size = abs(ray.direction)
    x_largest = (size.x >= size.y) & (size.x >= size.z)
    y_largest = ~x_largest & (size.y >= size.z)
    D = _turned(ray.direction, x_largest, y_largest)
    Sz = 1 / D.z
    Sx, Sy = D.x * Sz, D.y * Sz

    def corner(point: Any) -> Any:
        P = _turned(point - ray.origin, x_largest, y_largest)
        return type(P)(dr.fma(-Sx, P.z, P.x), dr.fma(-Sy, P.z, P.y), P.z * Sz)

    return Sheared(A=corner(triangle.first), B=corner(triangle.second), C=corner(triangle.third))


def edge_functions(sheared: Sheared, product: Callable[[Any, Any, Any, Any], Any]) -> tuple[Any, Any, Any]:
    """Return twice the signed areas opposite A, B and C; `product(a, b, c, d)` is a b - c d."""
    A, B, C = sheared.A, sheared.B, sheared.C
    return product(C.x, B.y, C.y, B.x), product(A.x, C.y, A.y, C.x), product(B.x, A.y, B.y, A.x)


def distance(sheared: Sheared, areas: tuple[Any, Any, Any], interval: Interval) -> Any:
    """Return t where no two areas differ in sign and t lies inside the interval, or inf."""
    U, V, W = areas
    outside = ((U < 0) | (V < 0) | (W < 0)) & ((U > 0) | (V > 0) | (W > 0))
    determinant = U + V + W
    parallel = determinant == 0
    t = (U * sheared.A.z + V * sheared.B.z + W * sheared.C.z) / dr.select(parallel, 1, determinant)
    return dr.select(interval.contains(t) & ~outside & ~parallel, t, dr.inf)
