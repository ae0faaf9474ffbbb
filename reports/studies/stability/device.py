"""Upload of ladders' inputs to the device, download of answers, and tests of the device's arithmetic."""

from collections.abc import Mapping
from typing import Any

import drjit as dr
import numpy as np

from rayproof.reference.certified.columns import Columns
from rayproof.tracer.kernel.arrays import ArrayTypes, array_types

ALIGNMENT = 256  # bytes


def uploaded(inputs: Mapping[str, np.ndarray], types: ArrayTypes) -> Columns:
    """Return inputs (rays,) as floats and (rays, 3) as vectors of the working precision; they are exact in it."""
    return {
        name: number(array, types) if array.ndim == 1 else types.Vector(*(number(c, types) for c in array.T))
        for name, array in inputs.items()
    }


def number(array: np.ndarray, types: ArrayTypes) -> Any:
    """Return a device array of one component."""
    wanted = np.dtype(np.float64 if types.precision == "float64" else np.float32)
    # Dr.Jit uses NumPy's memory without a copy and compiles another kernel for each pattern of misaligned inputs. With
    # the same alignment all ladders share a formula's kernel, which takes a hundred times longer to compile than to
    # run.
    room = np.empty(array.size * wanted.itemsize + ALIGNMENT, dtype=np.uint8)
    start = -room.ctypes.data % ALIGNMENT
    aligned = room[start : start + array.size * wanted.itemsize].view(wanted)
    aligned[:] = array
    return types.Float(aligned)


def downloaded(arrays: Mapping[str, Any], rays: int) -> dict[str, np.ndarray]:
    """Evaluate all arrays in one launch and return them as float64, (rays,) or (rays, 3)."""
    dr.eval(list(arrays.values()))
    return {name: _host(array, rays) for name, array in arrays.items()}


def _host(array: Any, rays: int) -> np.ndarray:
    if dr.depth_v(array) > 1:
        return np.stack([_host(component, rays) for component in array], axis=-1)
    return np.broadcast_to(np.array(array, dtype=np.float64), (rays,))


# Self-tests of the compiler: it must not treat NaN as a number, nor fuse a product and a sum of a formula.
#
# Either would give the same formula another arithmetic on another backend. `tracer.kernel.arrays` turns FastMath off,
# and LLVM does not contract a product and a sum by default. Both are tested here. Whether subnormal numbers are kept or
# flushed to zero depends on the backend and is no fault; the report states it.


PRODUCTS = 4096
LARGE = 65536


def _ask(precision: str, first: np.ndarray, second: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return x y and x y + z, where z = -fl(x y) is from an earlier kernel: the sum is 0 unless it is fused."""
    types = array_types(precision)
    x, y = number(first, types), number(second, types)
    product = x * y
    dr.eval(product)
    kept = number(-np.array(product, dtype=np.float64), types)
    rest = x * y + kept
    dr.eval(rest)
    return np.array(product, dtype=np.float64), np.array(rest, dtype=np.float64)


def broken(precision: str) -> list[str]:
    """Return a message for each failed self-test of a precision."""
    types = array_types(precision)
    wrong = []
    if dr.flag(dr.JitFlag.FastMath):
        wrong.append(f"{precision} on {types.backend}: FastMath is on")
    zero = number(np.array([np.nan, np.inf]), types) * 0
    if not np.all(np.isnan(np.array(zero, dtype=np.float64))):
        wrong.append(f"{precision} on {types.backend}: NaN times 0 or infinity times 0 is a number")
    generator = np.random.default_rng(1)
    _, rest = _ask(precision, *generator.uniform(1, 2, (2, PRODUCTS)).astype(np.float32).astype(np.float64))
    first = generator.uniform(1, 2, PRODUCTS)
    if precision == "float64":
        _, rest = _ask(precision, first, generator.uniform(1, 2, PRODUCTS))
    if np.any(rest):
        wrong.append(f"{precision} on {types.backend}: products are fused into sums")
    return wrong


def keeps_subnormals(precision: str) -> bool:
    """Return whether subnormal products are kept, not flushed to zero.

    The launch is large enough for Dr.Jit's worker threads, which flush on LLVM; a launch of a few numbers runs in the
    calling thread, which does not flush.
    """
    limits = np.finfo(np.float64 if precision == "float64" else np.float32)
    product, _ = _ask(precision, np.full(LARGE, float(limits.tiny)), np.full(LARGE, 0.25))
    return bool(np.all(product != 0))
