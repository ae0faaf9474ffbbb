"""4x4 matrices and 4-vectors in the precision of what they are made from."""

from typing import Any

import drjit as dr

from rayproof.tracer.device.arrays import array_types


def _types(like: Any) -> Any:
    return array_types("float64" if dr.type_v(like) == dr.VarType.Float64 else "float32")


def matrix(rows: list[list[Any]], *, like: Any) -> Any:
    """Return the 4x4 matrix of `rows` in the precision of the array `like`."""
    return _types(like).Matrix(rows)


def quad(x: Any, y: Any, z: Any, w: Any) -> Any:
    """Return (x, y, z, w) in the precision of `x`."""
    return _types(x).Quad(x, y, z, w)
