"""A shape with a high number, kept as long as the process, so that scenes of few shapes and of many share kernels.

Dr.Jit numbers all living objects, the lowest free number first. Into a kernel that calls two of their methods it writes
where the second one's table begins, and the first one's has a place for every number up to the highest.
"""

from functools import cache
from typing import Any

HIGHEST = 64  # a scene with more shapes has kernels of its own


@cache
def hold_a_high_number(mi: Any) -> Any:
    """Return the last of HIGHEST shapes with their materials; those of scenes take the numbers of the others."""
    return [mi.load_dict({"type": "disk"}) for _ in range(HIGHEST)][-1]
