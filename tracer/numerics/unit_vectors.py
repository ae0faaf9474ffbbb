"""Unit vectors along vectors of whatever length: squares of the very long and the very short would leave the range.

Lengths are taken to the middle of the range by an exact power of two. For literals, such as everything that belongs to
the camera, all of this folds away.

For vectors of ordinary length there is `normalized`. In float64 a division and a square root take as long as forty sums
or products, and half of that is found by sums and products alone.
"""

from typing import Any

import drjit as dr

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

    That is the bound of sqrt(1 / x) as well: half of what the division rounds, and what the root does. Here what is
    rounded before the last sum is x y, which counts half, too: y' = y + y e / 2 with e = 1 - (x y) y.
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
