"""The same numbers in float64, for the few operations that a formula wants to be exact."""

from typing import Any

import drjit as dr


def in_float64(array: Any) -> Any:
    """Return a scalar or vector of any precision in float64."""
    kind: Any = dr.float64_array_t(type(array))
    return kind(array)
