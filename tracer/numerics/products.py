"""Differences of two products that keep their digits, in explicit fused operations that no compiler can fuse again.

Source: Kahan, as analysed by Jeannerod, Louvet and Muller, "Further Analysis of Kahan's Algorithm for the Accurate
Computation of 2x2 Determinants", Mathematics of Computation 82 (2013): at most 1.5 ulp.
"""

from typing import Any

import drjit as dr


def difference_of_products(a: Any, b: Any, c: Any, d: Any) -> Any:
    """Return a b - c d."""
    cd = c * d
    return dr.fma(a, b, -cd) + dr.fma(-c, d, cd)
