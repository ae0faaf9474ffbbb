"""Arrays that a scene keeps on the device, uploaded when first asked for.

A frozen function must be given them as arguments: whoever freezes traces once, takes `arrays` and hands them in again.
"""

from collections.abc import Callable
from typing import Any

import drjit as dr
import numpy as np

from rayproof.tracer.device.arrays import ArrayTypes

ALIGNMENT = 64  # bytes; packets are read from aligned memory only, and numpy's is aligned to 16


def aligned(shape: tuple[int, ...], dtype: Any) -> np.ndarray:
    """Return a new array of undefined values in aligned memory."""
    size = int(np.prod(shape)) * np.dtype(dtype).itemsize
    memory = np.empty(size + ALIGNMENT, dtype=np.uint8)
    start = -memory.ctypes.data % ALIGNMENT
    return memory[start : start + size].view(dtype).reshape(shape)


def _in_a_row(values: np.ndarray) -> np.ndarray:
    """Return the numbers in a row in aligned memory: on the CPU it is Dr.Jit's array from then on."""
    if values.ctypes.data % ALIGNMENT == 0 and values.flags.c_contiguous and values.flags.writeable:
        return values.reshape(-1)
    row = aligned((values.size,), values.dtype)
    row[:] = values.reshape(-1)
    return row


class DeviceBuffers:
    """Dr.Jit arrays by name."""

    def __init__(self, arrays: dict[str, Any] | None = None) -> None:
        self.arrays: dict[str, Any] = {} if arrays is None else arrays

    def upload(self, name: str, kind: Any, values: Callable[[], np.ndarray]) -> Any:
        """Return the array called `name`, made from a host array on the first call."""
        if name not in self.arrays:
            self.arrays[name] = kind(_in_a_row(np.asarray(values())))
        return self.arrays[name]

    def floats(self, name: str, types: ArrayTypes, values: Callable[[], np.ndarray]) -> Any:
        """Return an array of the precision of `types`, rounded once."""
        kind = np.float64 if types.precision == "float64" else np.float32
        return self.upload(f"{name}, {types.precision}", types.Float, lambda: np.asarray(values(), dtype=kind))


def packets(types: ArrayTypes, source: Any, record: Any, count: int) -> list[Any]:
    """Return the numbers of a record of `count` packets of four; `source` may be float or UInt."""
    Packet: Any = dr.replace_type_t(types.Quad, dr.type_v(source))
    return [word for k in range(count) for word in dr.gather(Packet, source, record * count + k)]
