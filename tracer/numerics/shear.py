"""The shear that turns a ray into the z axis: triangles are then decided in two dimensions, by signs alone.

Source: Woop, Benthin and Wald, "Watertight Ray/Triangle Intersection", Journal of Computer Graphics Techniques 2
(2013). The same corner is sheared to the same numbers in every triangle that shares it; each product and sum is an
explicit operation, because a compiler that fused some of them would tear the edges open.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import drjit as dr

from rayproof.tracer.rays import Interval, Ray


@dataclass(frozen=True, kw_only=True)
class Sheared:
    """A triangle's corners A, B, C beside the ray: x and y across it, z along it [m]."""

    A: Any
    B: Any
    C: Any


@dataclass(frozen=True, kw_only=True)
class Shear:
    """The turn that makes a direction's largest component the last one, and the shear that takes it to the z axis."""

    x_largest: Any
    y_largest: Any
    origin: Any  # of the ray, turned [m]
    Sx: Any
    Sy: Any
    Sz: Any


def _turned(vector: Any, x_largest: Any, y_largest: Any) -> Any:
    """Return the components in cyclic order with the ray's largest last, which keeps the winding."""
    x, y, z = vector.x, vector.y, vector.z
    return type(vector)(
        dr.select(x_largest, y, dr.select(y_largest, z, x)),
        dr.select(x_largest, z, dr.select(y_largest, x, y)),
        dr.select(x_largest, x, dr.select(y_largest, y, z)),
    )


def _turn(direction: Any) -> tuple[Any, Any]:
    size = abs(direction)
    x_largest = (size.x >= size.y) & (size.x >= size.z)
    return x_largest, ~x_largest & (size.y >= size.z)


def _of(ray: Ray, x_largest: Any, y_largest: Any) -> Shear:
    D = _turned(ray.direction, x_largest, y_largest)
    Sz = 1 / D.z
    origin = _turned(ray.origin, x_largest, y_largest)
    return Shear(x_largest=x_largest, y_largest=y_largest, origin=origin, Sx=D.x * Sz, Sy=D.y * Sz, Sz=Sz)


def prepared(rays: Sequence[Ray], *, together: bool = False) -> list[Ray]:
    """Return rays that have their own shear with them, for a loop in which they meet many triangles.

    Rays of nearly the same direction may all turn as the middle one does (`together`); what is left is then computed
    once for all of them. Any component may come last that is not much smaller than the largest.
    """
    middle = _turn(rays[len(rays) // 2].direction)
    return [replace(ray, shear=_of(ray, *(middle if together else _turn(ray.direction)))) for ray in rays]


def turns(rays: Sequence[Ray]) -> list[tuple[Any, Any]]:
    """Return how prepared rays turn: where x is the largest component, and where y is."""
    return [(ray.shear.x_largest, ray.shear.y_largest) for ray in rays]


def turning_alike(rays: Sequence[Ray], turn: tuple[Any, Any]) -> list[Ray]:
    """Return prepared rays, all turned in this way, as those that count are: a corner is turned once for all."""
    return [replace(ray, shear=replace(ray.shear, x_largest=turn[0], y_largest=turn[1])) for ray in rays]


def shear(ray: Ray, triangle: Any) -> Sheared:
    """Return the triangle in the ray's own coordinates; z is t."""
    own = ray.shear or _of(ray, *_turn(ray.direction))

    def corner(point: Any) -> Any:
        # Turned before it is subtracted: rays that turn alike share that, wherever they start.
        P = _turned(point, own.x_largest, own.y_largest) - own.origin
        return type(P)(dr.fma(-own.Sx, P.z, P.x), dr.fma(-own.Sy, P.z, P.y), P.z * own.Sz)

    return Sheared(A=corner(triangle.first), B=corner(triangle.second), C=corner(triangle.third))


def edge_functions(sheared: Sheared, product: Callable[[Any, Any, Any, Any], Any]) -> tuple[Any, Any, Any]:
    """Return twice the signed areas opposite A, B and C; `product(a, b, c, d)` is a b - c d."""
    A, B, C = sheared.A, sheared.B, sheared.C
    return product(C.x, B.y, C.y, B.x), product(A.x, C.y, A.y, C.x), product(B.x, A.y, B.y, A.x)


def _smaller(a: Any, b: Any) -> Any:
    return dr.select(a < b, a, b)


def _larger(a: Any, b: Any) -> Any:
    return dr.select(a > b, a, b)


def distance(sheared: Sheared, areas: tuple[Any, Any, Any], interval: Interval) -> Any:
    """Return t where no two areas differ in sign and t lies inside the interval, or inf."""
    U, V, W = areas
    outside = (_smaller(_smaller(U, V), W) < 0) & (_larger(_larger(U, V), W) > 0)
    determinant = U + V + W
    parallel = determinant == 0
    t = (U * sheared.A.z + V * sheared.B.z + W * sheared.C.z) / dr.select(parallel, 1, determinant)
    return dr.select(interval.contains(t) & ~outside & ~parallel, t, dr.inf)
