"""Dr.Jit's array types and backends, and `Lanes`: the assignment of an image's samples to SIMD lanes.

This is the only file that names backends and precisions. Dr.Jit's FastMath is turned off here, because with it the CPU
and GPU backends compute differently and NaN * 0 becomes 0.

* A SIMD lane computes one sample, or a tile of several samples that traverse the tree together. Neighbouring lanes have
  neighbouring tiles, in blocks of four by four, so that the rays of a packet are close in the image as well.
* A processor executes eight or sixteen lanes at a time, and all of them pay for code that one lane needs. `where` skips
  code that no lane of a packet needs.
* The samples of a lane are computed in steps: a step of all of them comes before the next step of any. Dr.Jit emits the
  code of one scope before that of the next, and within a scope it emits each result with all its inputs, sample by
  sample. A sample's operations depend on each other, and a processor looks some two hundred instructions ahead, less
  than one sample has: in steps it can execute operations of other samples meanwhile.
"""

import importlib
import importlib.metadata
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any

import drjit as dr
import numpy as np

from rayproof.tracer.kernel import compiler

SUFFIXES = {"float32": "f", "float64": "f64"}  # of the names of Dr.Jit's types
BACKENDS = {"cuda": dr.JitBackend.CUDA, "llvm": dr.JitBackend.LLVM}  # in the order of preference
VARIABLE = "RAYPROOF_BACKEND"  # an environment variable that selects the backend on a machine that has both


@dataclass(frozen=True, kw_only=True)
class ArrayTypes:
    """One Dr.Jit backend at one precision.

    The fields are Dr.Jit's classes; Vector has three components, Quad four, Packet as many as it is given.
    """

    precision: str
    backend: str  # "cuda" or "llvm"
    Float: Any
    Vector: Any
    Quad: Any
    Packet: Any
    Matrix: Any  # 4x4
    Int: Any  # 32 bits
    UInt: Any  # 32 bits
    Bool: Any


@cache
def backend() -> str:
    """Return the value of RAYPROOF_BACKEND; without it "cuda" if Dr.Jit finds an NVIDIA GPU, else "llvm".

    Raises:
        NoBackendError: Dr.Jit has no backend, or lacks the named one; using it would abort the process.

    """
    wanted = os.environ.get(VARIABLE)
    for name, types in BACKENDS.items():
        if wanted in (None, "", name) and dr.has_backend(types):
            return name
    if wanted:
        raise compiler.NoBackendError(
            f"{VARIABLE}={wanted}, but Dr.Jit has no such backend here; known: {', '.join(BACKENDS)}"
        )
    raise compiler.NoBackendError(
        "Dr.Jit finds neither an NVIDIA GPU nor a usable LLVM; install karellen-llvm-core (and the system's "
        f"libatomic1), or name an LLVM library of version 19 or later in {compiler.VARIABLE}"
    )


@cache
def array_types(precision: str) -> ArrayTypes:
    """Return the array types of `precision` on this machine's backend.

    Raises:
        LookupError: the precision is neither float32 nor float64.
        NoBackendError: Dr.Jit has no backend.

    """
    if precision not in SUFFIXES:
        raise LookupError(f"no precision is called {precision!r}; known: {', '.join(SUFFIXES)}")
    name = backend()
    module = importlib.import_module(f"drjit.{name}")
    dr.set_flag(dr.JitFlag.FastMath, False)
    suffix = SUFFIXES[precision]
    return ArrayTypes(
        precision=precision,
        backend=name,
        Float=module.Float64 if precision == "float64" else module.Float32,
        Vector=getattr(module, f"Array3{suffix}"),
        Quad=getattr(module, f"Array4{suffix}"),
        Packet=getattr(module, f"ArrayX{suffix}"),
        Matrix=getattr(module, f"Matrix4{suffix}"),
        Int=module.Int32,
        UInt=module.UInt32,
        Bool=module.Bool,
    )


BLOCK = 4  # tiles, per side


@dataclass(frozen=True, kw_only=True)
class Lanes:
    """An image of width x height samples, cut into tiles of `columns` x `rows`, one per lane."""

    width: int
    height: int
    columns: int = 1
    rows: int = 1

    @property
    def tile(self) -> int:
        """Return the samples per lane."""
        return self.columns * self.rows

    @cached_property
    def _blocks(self) -> tuple[int, int]:
        across, down = self.columns * BLOCK, self.rows * BLOCK
        return -(-self.width // across), -(-self.height // down)

    @property
    def count(self) -> int:
        """Return the number of lanes; tiles that reach over the border repeat its samples."""
        return self.width * self.height if self.tile == 1 else self._blocks[0] * self._blocks[1] * BLOCK * BLOCK

    def positions(self, UInt: Any) -> list[tuple[Any, Any]]:
        """Return (column, row) of each of a lane's samples."""
        index = dr.arange(UInt, self.count)
        if self.tile == 1:
            row = index // self.width
            return [(index - row * self.width, row)]
        block, place = index // (BLOCK * BLOCK), index % (BLOCK * BLOCK)
        down = block // self._blocks[0]
        left = ((block - down * self._blocks[0]) * BLOCK + place % BLOCK) * self.columns
        top = (down * BLOCK + place // BLOCK) * self.rows
        columns = self._within(left, self.width, self.columns)
        rows = self._within(top, self.height, self.rows)
        return [(column, row) for row in rows for column in columns]

    @staticmethod
    def _within(first: Any, size: int, count: int) -> list[Any]:
        """Return a tile's coordinates along one axis, clamped to the image."""
        if size % (count * BLOCK) == 0:
            return [first + k for k in range(count)]
        if size % count == 0:
            # Tiles lie inside or outside as a whole, and stay whole: neighbours are written together.
            first = dr.minimum(first, size - count)
            return [first + k for k in range(count)]
        return [dr.minimum(first + k, size - 1) for k in range(count)]

    def numbers(self, positions: list[tuple[Any, Any]]) -> list[Any]:
        """Return each sample's number in the image, row by row."""
        return [row * self.width + column for column, row in positions]

    def image(self, values: list[np.ndarray]) -> np.ndarray:
        """Return (height, width) from each of the lane's samples, (lanes,); a literal fills its samples."""
        if self.tile == 1:
            return np.broadcast_to(values[0], (self.count,)).reshape(self.height, self.width)
        across, down = self._blocks
        full = np.stack([np.broadcast_to(value, (self.count,)) for value in values])
        blocks = full.reshape(self.rows, self.columns, down, across, BLOCK, BLOCK)
        # (row in tile, column in tile, block row, block column, tile row, tile column)
        return blocks.transpose(2, 4, 0, 3, 5, 1).reshape(down * BLOCK * self.rows, -1)[: self.height, : self.width]


def versions() -> dict[str, str]:
    """Return drjit, backend, llvm, llvm_path and the flags FastMath and others, as text for the report."""
    array_types("float32")
    name = backend()
    facts = {"drjit": importlib.metadata.version("drjit"), "backend": name}
    if name == "llvm":
        facts["llvm"] = ".".join(map(str, dr.detail.llvm_version()))
        facts["llvm_path"] = os.environ.get(compiler.VARIABLE, "chosen by Dr.Jit")
    else:
        facts["cuda"] = ".".join(map(str, dr.detail.cuda_version()))
    for flag in ("FastMath", "SymbolicLoops", "OptimizeLoops", "ConstantPropagation"):
        facts[f"drjit_{flag}"] = "on" if dr.flag(getattr(dr.JitFlag, flag)) else "off"
    return facts


_ASKED: ContextVar[list[Any] | None] = ContextVar("asked", default=None)  # the list to which masks are appended, if any


def where(mask: Any, compute: Callable[[], list[Any]], otherwise: list[Any]) -> list[Any]:
    """Return the results of `compute` in lanes of `mask`, else `otherwise`; packets without such lanes skip it."""
    masks = _ASKED.get()
    if masks is not None:
        masks.append(mask)
        return compute()
    # Dr.Jit writes the results into the returned arrays, so that none may be returned twice.
    return dr.if_stmt((), mask, compute, lambda: [type(array)(array) for array in otherwise])


@contextmanager
def asked() -> Iterator[list[Any]]:
    """Collect the masks of all calls of `where`, in the order of the code, and compute every branch everywhere."""
    masks: list[Any] = []
    token = _ASKED.set(masks)
    try:
        yield masks
    finally:
        _ASKED.reset(token)


def next_step(types: ArrayTypes, *, samples: int) -> None:
    """End a step: later operations come after all earlier ones in the kernel.

    With one sample per lane there is nothing to interleave.
    """
    if samples > 1:
        dr.detail.new_scope(BACKENDS[types.backend])
