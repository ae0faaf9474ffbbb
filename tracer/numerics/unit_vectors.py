"""Unit vectors along vectors of whatever length: squares of the very long and the very short would leave the range.

Lengths are taken to the middle of the range by an exact power of two. For literals, such as everything that belongs to
the camera, all of this folds away.
"""

from typing import Any

import drjit as dr

# Beyond 2^SMALL and 2^-SMALL a vector is multiplied by 2^-STEP or 2^STEP: then even the squares of subnormals and of
# the largest numbers are ordinary.
SMALL = {"float32": 50, "float64": 400}
STEP = {"float32": 90, "float64": 700}


def unit(vector: Any) -> Any:
    """Return the vector over its length."""
    precision = "float64" if dr.type_v(vector) == dr.VarType.Float64 else "float32"
    edge, step = 2.0 ** SMALL[precision], 2.0 ** STEP[precision]
    largest = dr.max(abs(vector))
    Float: Any = type(largest)
    scale = dr.select(largest > edge, Float(1 / step), dr.select(largest < 1 / edge, Float(step), Float(1)))
    return dr.normalize(vector * scale)
