"""What the compiler must not do: treat NaN as a number, or fuse a product into a sum behind a formula's back.

Either would make the same formula different arithmetics on different backends. FastMath is turned off by
`tracer.kernel.arrays`; LLVM does not contract a product and a sum unless it is told to. Both are asked, not assumed.
What subnormals become is no fault, it differs by backend: the report says which.
"""

import drjit as dr
import numpy as np

from rayproof.reports.studies.stability.device import number
from rayproof.tracer.kernel.arrays import array_types

PRODUCTS = 4096
LARGE = 65536


def _ask(precision: str, first: np.ndarray, second: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return x y and x y + z with z = -fl(x y) from an earlier kernel, so that only a fused product is off zero."""
    types = array_types(precision)
    x, y = number(first, types), number(second, types)
    product = x * y
    dr.eval(product)
    kept = number(-np.array(product, dtype=np.float64), types)
    rest = x * y + kept
    dr.eval(rest)
    return np.array(product, dtype=np.float64), np.array(rest, dtype=np.float64)


def broken(precision: str) -> list[str]:
    """Return in words which guards do not hold in a precision; nothing where all do."""
    types = array_types(precision)
    found = []
    if dr.flag(dr.JitFlag.FastMath):
        found.append(f"{precision} on {types.backend}: FastMath is on")
    zero = number(np.array([np.nan, np.inf]), types) * 0
    if not np.all(np.isnan(np.array(zero, dtype=np.float64))):
        found.append(f"{precision} on {types.backend}: NaN times 0 or infinity times 0 is a number")
    generator = np.random.default_rng(1)
    _, rest = _ask(precision, *generator.uniform(1, 2, (2, PRODUCTS)).astype(np.float32).astype(np.float64))
    first = generator.uniform(1, 2, PRODUCTS)
    if precision == "float64":
        _, rest = _ask(precision, first, generator.uniform(1, 2, PRODUCTS))
    if np.any(rest):
        found.append(f"{precision} on {types.backend}: products are fused into sums")
    return found


def keeps_subnormals(precision: str) -> bool:
    """Return whether a subnormal product stays what it is; flushed to zero, it is gone.

    Asked in a launch large enough for Dr.Jit's worker threads, which flush on LLVM; a launch of a few numbers runs in
    the calling thread, which does not.
    """
    limits = np.finfo(np.float64 if precision == "float64" else np.float32)
    product, _ = _ask(precision, np.full(LARGE, float(limits.tiny)), np.full(LARGE, 0.25))
    return bool(np.all(product != 0))
