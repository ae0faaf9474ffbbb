"""Inputs of a kernel: arrays on the device, and a scene's numbers as literals or in memory (`KernelConstants`).

Arrays of a scene on the device are uploaded at their first use. A frozen function must get them as arguments: trace
once, take `arrays`, and pass them at every call.

A scene's numbers are literals of the kernel if one scene is rendered often, and in memory if many scenes are rendered
once. Literals save a load each and can be folded, but every scene compiles a kernel of its own. Scenes of the same
structure share a kernel if their numbers are in memory. Unneeded terms, such as an identity transform or a coefficient
of 0, are left out in both cases. If several stages are requested, their images are in memory anyway, and each stage may
start from there: its kernel is then shared by scenes and configurations that differ in another stage. Each unrolled
shape is such a stage, so that scenes with different numbers of shapes share its kernel. docs/developers.md has the
costs.
"""

from collections.abc import Callable
from typing import Any, Protocol

import drjit as dr
import numpy as np

from rayproof.tracer.kernel.arrays import ArrayTypes

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
        return self.upload(f"{name}, {types.precision}", types.Float, lambda: np.asarray(values(), types.precision))


def packets(types: ArrayTypes, source: Any, record: Any, count: int) -> list[Any]:
    """Return the numbers of a record of `count` packets of four; `source` may be float or UInt."""
    Packet: Any = dr.replace_type_t(types.Quad, dr.type_v(source))
    return [word for k in range(count) for word in dr.gather(Packet, source, record * count + k)]


class KernelConstants(Protocol):
    """How numbers enter a kernel: as literals, or from memory."""

    shared: bool  # whether kernels are to be short and the same for as many scenes as possible

    def __call__(self, name: str, value: Any) -> Any:
        """Return the Dr.Jit literal `value`, a number, vector or matrix; `name` is unique and describes it."""

    def store(self, *values: Any) -> None:
        """Let a kernel end here, if kernels are to be shared, with `values` (any tree of arrays) in memory."""

    def per_lane(self, value: Any, width: int) -> Any:
        """Return the value, if kernels are to be shared once for each of `width` lanes and in memory.

        Then it is the same code whether it differs from lane to lane, and whether a kernel has changed it before.
        """


class Literals:
    """Numbers that are part of the code."""

    shared = False

    def __call__(self, name: str, value: Any) -> Any:
        """Return the value as it is."""
        return value

    def store(self, *values: Any) -> None:
        """Continue the kernel."""

    def per_lane(self, value: Any, width: int) -> Any:
        """Return the value as it is."""
        return value


class NumbersInMemory(Literals):
    """Numbers that are read from memory."""

    def __init__(self) -> None:
        self._kept: dict[tuple[str, type], Any] = {}

    def __call__(self, name: str, value: Any) -> Any:
        """Return the value in memory, the same for one name and type; a mask stays a literal, since it selects code."""
        if dr.is_mask_v(value):
            return value
        key = (name, type(value))
        if key not in self._kept:
            copied = type(value)(value)
            dr.make_opaque(copied)
            self._kept[key] = copied
        return self._kept[key]


class SplitKernels(NumbersInMemory):
    """Numbers in memory, and stages whose results are in memory too, so that each stage is a kernel."""

    shared = True

    def store(self, *values: Any) -> None:
        """Let a kernel end here, with the values in memory; inside a loop of the kernel nothing can end."""
        if not dr.flag(dr.JitFlag.SymbolicScope):
            dr.eval(*values)

    def per_lane(self, value: Any, width: int) -> Any:
        """Return the value in memory, once for each lane; inside a loop of the kernel, as it is."""
        if dr.width(value) == width or dr.flag(dr.JitFlag.SymbolicScope):
            return value
        laid_out = dr.repeat(value, width)
        dr.make_opaque(laid_out)
        return laid_out


LITERALS = Literals()
