"""Arithmetic that formulas share: fused differences of products, stable roots, unit vectors, sheared edge functions.

* Differences of products keep their digits by explicit fused operations, which no compiler can fuse again. Source:
  Kahan, as analysed by Jeannerod, Louvet and Muller, "Further Analysis of Kahan's Algorithm for the Accurate
  Computation of 2x2 Determinants", Mathematics of Computation 82 (2013): at most 1.5 ulp.
* `unit` first scales a vector by an exact power of two, since the squares of very long and very short vectors would
  overflow or underflow; for literals, such as the camera's vectors, this folds away. `normalized` is for vectors of
  ordinary length: in float64 a division and a square root take as long as forty sums or products, and half of the
  digits are computed by sums and products only.
* The shear turns a ray into the z axis, so that triangles are decided in two dimensions, only by signs. Source:
  Woop, Benthin and Wald, "Watertight Ray/Triangle Intersection", Journal of Computer Graphics Techniques 2 (2013).
  The same corner is sheared to the same numbers in every triangle that shares it; each product and sum is an explicit
  operation, because a compiler that fused some of them would tear the edges open.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import drjit as dr

from rayproof.tracer.kernel.arrays import array_types
from rayproof.tracer.rays import Interval, Ray


def _types(like: Any) -> Any:
    return array_types("float64" if dr.type_v(like) == dr.VarType.Float64 else "float32")


def matrix(rows: list[list[Any]], *, like: Any) -> Any:
    """Return the 4x4 matrix of `rows` in the precision of the array `like`."""
    return _types(like).Matrix(rows)


def quad(x: Any, y: Any, z: Any, w: Any) -> Any:
    """Return (x, y, z, w) in the precision of `x`."""
    return _types(x).Quad(x, y, z, w)


def in_float64(array: Any) -> Any:
    """Return a scalar or vector of any precision in float64."""
    kind: Any = dr.float64_array_t(type(array))
    return kind(array)


def _bits(x: Any) -> Any:
    kind: Any = dr.int64_array_t(type(x)) if dr.type_v(x) == dr.VarType.Float64 else dr.int32_array_t(type(x))
    return dr.reinterpret_array(kind, x)


def moved_by_ulps(x: Any, steps: Any) -> Any:
    """Return the float that is `steps` (whole, as a float) steps away, upwards if positive; not across 0."""
    bits = _bits(x)
    count = type(bits)(steps)
    return dr.reinterpret_array(type(x), bits + dr.select(x < 0, -count, count))


def next_towards(x: Any, sign: Any) -> Any:
    """Return the next float above `x` where `sign` > 0, below it where `sign` < 0, else `x`."""
    smallest = dr.reinterpret_array(type(x), type(_bits(x))(1))
    moved = dr.select(x == 0, dr.copysign(smallest, sign), moved_by_ulps(x, dr.select(sign > 0, 1.0, -1.0)))
    return dr.select(sign == 0, x, moved)


def difference_of_products(a: Any, b: Any, c: Any, d: Any) -> Any:
    """Return a b - c d."""
    cd = c * d
    return dr.fma(a, b, -cd) + dr.fma(-c, d, cd)


def ordered(first: Any, second: Any) -> tuple[Any, Any]:
    """Return the two, the smaller first."""
    swap = first > second
    return dr.select(swap, second, first), dr.select(swap, first, second)


def stable_roots(A: Any, h: Any, C: Any, root: Any) -> tuple[Any, Any]:
    """Return the roots in order; `root` is the square root of h^2 - A C.

    Source: Blinn, "How to Solve a Quadratic Equation", IEEE Computer Graphics and Applications (2005 and 2006).
    """
    # The root farther from zero never cancels; the product of the roots, C / A, gives the other one. A sign of 0 would
    # lose it where h = 0: copysign has none.
    q = h + dr.copysign(root, h)
    return ordered(dr.select(q == 0, 0, C / q), q / A)


# Beyond 2^SMALL and 2^-SMALL a vector is multiplied by 2^-STEP or 2^STEP: then even the squares of subnormals and of
# the largest numbers are ordinary.
SMALL = {"float32": 50, "float64": 400}
STEP = {"float32": 90, "float64": 700}

# Half of the bits of x, taken from these, are those of 1 / sqrt(x) up to 3.5 % of it: Robertson, "A Brief History of
# InvSqrt" (2012).
BITS = 0x5FE6EB50C7B537A9


def unit(vector: Any) -> Any:
    """Return the vector over its length."""
    precision = "float64" if dr.type_v(vector) == dr.VarType.Float64 else "float32"
    edge, step = 2.0 ** SMALL[precision], 2.0 ** STEP[precision]
    largest = dr.max(abs(vector))
    Float: Any = type(largest)
    scale = dr.select(largest > edge, Float(1 / step), dr.select(largest < 1 / edge, Float(step), Float(1)))
    return dr.normalize(vector * scale)


def inverse_root(x: Any) -> Any:
    """Return 1 / sqrt(x) of numbers that are not negative, with an error of 1.5 u at most; 1 / 0 is inf, 1 / inf is 0.

    The bound of sqrt(1 / x) is the same: half the rounding error of the division, and that of the root. Here the
    rounding error of x y before the last sum also counts half: y' = y + y e / 2 with e = 1 - (x y) y.
    """
    if dr.type_v(x) != dr.VarType.Float64:
        return dr.rsqrt(x)
    Bits: Any = dr.uint64_array_t(type(x))
    bits: Any = dr.reinterpret_array(Bits, x)
    y: Any = dr.reinterpret_array(type(x), Bits(BITS) - (bits >> 1))
    for _ in range(2):  # 3.5e-2 -> 1.1e-4 -> 4e-12 -> 3e-23
        e = dr.fma(-(x * y), y, 1)
        y = dr.fma(y * e, dr.fma(e, 0.375, 0.5), y)
    y = dr.fma(y * 0.5, dr.fma(-(x * y), y, 1), y)
    return dr.select(x == dr.inf, 0, dr.select(x == 0, dr.inf, y))


def normalized(vector: Any) -> Any:
    """Return the vector over its length, whose square is in the range."""
    return vector * inverse_root(dr.squared_norm(vector))


@dataclass(frozen=True, kw_only=True)
class Sheared:
    """A triangle's corners A, B, C in the ray's coordinates [m]: x and y across the ray, z along it."""

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
    """Return rays with their shears, for a loop in which they meet many triangles.

    Rays of nearly the same direction may share the axes of the middle one (`together`), so that a corner is permuted
    once for all of them. Any component that is not much smaller than the largest may become the last.
    """
    middle = _turn(rays[len(rays) // 2].direction)
    return [replace(ray, shear=_of(ray, *(middle if together else _turn(ray.direction)))) for ray in rays]


def turns(rays: Sequence[Ray]) -> list[tuple[Any, Any]]:
    """Return the masks of prepared rays whose largest component is x, and of those with y."""
    return [(ray.shear.x_largest, ray.shear.y_largest) for ray in rays]


def turning_alike(rays: Sequence[Ray], turn: tuple[Any, Any]) -> list[Ray]:
    """Return prepared rays that share these axes, as all active rays do: a corner is permuted once for all."""
    return [replace(ray, shear=replace(ray.shear, x_largest=turn[0], y_largest=turn[1])) for ray in rays]


def shear(ray: Ray, triangle: Any) -> Sheared:
    """Return the triangle in the ray's own coordinates; z is t."""
    own = ray.shear or _of(ray, *_turn(ray.direction))

    def corner(point: Any) -> Any:
        # Permuted before the subtraction: rays with the same axes share the result, whatever their origins.
        P = _turned(point, own.x_largest, own.y_largest) - own.origin
        return type(P)(dr.fma(-own.Sx, P.z, P.x), dr.fma(-own.Sy, P.z, P.y), P.z * own.Sz)

    return Sheared(A=corner(triangle.first), B=corner(triangle.second), C=corner(triangle.third))


def edge_functions(sheared: Sheared, product: Callable[[Any, Any, Any, Any], Any]) -> tuple[Any, Any, Any]:
    """Return twice the signed areas opposite A, B and C; `product(a, b, c, d)` is a b - c d."""
    A, B, C = sheared.A, sheared.B, sheared.C
    return product(C.x, B.y, C.y, B.x), product(A.x, C.y, A.y, C.x), product(B.x, A.y, B.y, A.x)


def smaller(a: Any, b: Any) -> Any:
    """Return the smaller by a single instruction; a minimum that propagates NaN takes several."""
    return dr.select(a < b, a, b)


def larger(a: Any, b: Any) -> Any:
    """Return the larger."""
    return dr.select(a > b, a, b)


def distance(sheared: Sheared, areas: tuple[Any, Any, Any], interval: Interval) -> Any:
    """Return t if no two areas differ in sign and t is inside the interval, or inf."""
    U, V, W = areas
    outside = (smaller(smaller(U, V), W) < 0) & (larger(larger(U, V), W) > 0)
    determinant = U + V + W
    # A sum of 0 without areas of both signs is of three zeros: t is a NaN then, which no interval contains.
    t = (U * sheared.A.z + V * sheared.B.z + W * sheared.C.z) / determinant
    return dr.select(interval.contains(t) & ~outside, t, dr.inf)
