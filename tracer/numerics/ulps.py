"""Floats by their bits."""

from typing import Any

import drjit as dr


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
