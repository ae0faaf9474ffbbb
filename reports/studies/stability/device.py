"""Ladders' inputs on the device, and answers back as float64."""

from collections.abc import Mapping
from typing import Any

import drjit as dr
import numpy as np

from rayproof.reports.studies.stability.exactly import Columns
from rayproof.tracer.kernel.arrays import ArrayTypes

ALIGNMENT = 256  # bytes


def uploaded(inputs: Mapping[str, np.ndarray], types: ArrayTypes) -> Columns:
    """Return inputs (rays,) as floats and (rays, 3) as vectors, in the working precision, which has them exactly."""
    return {
        name: number(array, types) if array.ndim == 1 else types.Vector(*(number(c, types) for c in array.T))
        for name, array in inputs.items()
    }


def number(array: np.ndarray, types: ArrayTypes) -> Any:
    """Return a device array of one component."""
    wanted = np.dtype(np.float64 if types.precision == "float64" else np.float32)
    # Dr.Jit takes NumPy's memory as it lies and makes another kernel for every pattern of misaligned inputs: with the
    # same alignment all ladders share a formula's kernel, which takes a hundred times longer to make than to run.
    room = np.empty(array.size * wanted.itemsize + ALIGNMENT, dtype=np.uint8)
    start = -room.ctypes.data % ALIGNMENT
    aligned = room[start : start + array.size * wanted.itemsize].view(wanted)
    aligned[:] = array
    return types.Float(aligned)


def downloaded(arrays: Mapping[str, Any], rays: int) -> dict[str, np.ndarray]:
    """Evaluate all arrays in one go; return each as float64, (rays,) or (rays, 3)."""
    dr.eval(list(arrays.values()))
    return {name: _host(array, rays) for name, array in arrays.items()}


def _host(array: Any, rays: int) -> np.ndarray:
    if dr.depth_v(array) > 1:
        return np.stack([_host(component, rays) for component in array], axis=-1)
    return np.broadcast_to(np.array(array, dtype=np.float64), (rays,))
