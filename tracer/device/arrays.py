"""The array types that the tracer computes with: the only file that names backends and precisions.

Dr.Jit's FastMath is turned off here, because it makes the CPU and GPU backends different arithmetics and turns
NaN * 0 into 0.
"""

import importlib
import os
from dataclasses import dataclass
from functools import cache
from typing import Any

import drjit as dr

from rayproof.tracer.device import llvm

SUFFIXES = {"float32": "f", "float64": "f64"}  # of the names of Dr.Jit's types
BACKENDS = {"cuda": dr.JitBackend.CUDA, "llvm": dr.JitBackend.LLVM}  # the first that is there is taken
VARIABLE = "RAYPROOF_BACKEND"  # names one of them, for a machine that has both


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
    """Return what RAYPROOF_BACKEND names; without it "cuda" where Dr.Jit finds an NVIDIA GPU, else "llvm".

    Raises:
        NoBackendError: Dr.Jit has neither, or not the one that is named; using it anyway would kill the process.

    """
    wanted = os.environ.get(VARIABLE)
    for name, found in BACKENDS.items():
        if wanted in (None, "", name) and dr.has_backend(found):
            return name
    if wanted:
        raise llvm.NoBackendError(
            f"{VARIABLE}={wanted}, but Dr.Jit has no such backend here; known: {', '.join(BACKENDS)}"
        )
    raise llvm.NoBackendError(
        "Dr.Jit finds neither an NVIDIA GPU nor a usable LLVM; install karellen-llvm-core (and the system's "
        f"libatomic1), or name an LLVM library of version 19 or later in {llvm.VARIABLE}"
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
