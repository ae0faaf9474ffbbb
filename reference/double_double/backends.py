"""Dr.Jit's LLVM backend, found or explained, with the one flag that pairs depend on."""

from contextlib import AbstractContextManager
from importlib.util import find_spec
from typing import Any


def unavailable() -> str | None:
    """Return a sentence that says why pairs cannot be computed on this machine, or None if they can.

    On a GPU products may be fused into sums, which breaks the error of a product; so LLVM alone is used.
    """
    if find_spec("drjit") is None:
        return "Dr.Jit is not installed; pip install drjit."
    import drjit

    # Asked first, because using the backend without a library kills the process.
    if not drjit.has_backend(drjit.JitBackend.LLVM):
        return "Dr.Jit finds no LLVM library that it accepts; set DRJIT_LIBLLVM_PATH to one, version 17 or later."
    return None


def types() -> Any:
    """Return the module of Dr.Jit's LLVM arrays."""
    import drjit.llvm

    return drjit.llvm


def fast_math_off() -> AbstractContextManager[None]:
    """Compute the body as written: by default Dr.Jit may reorder, and takes x times 0 for 0."""
    import drjit

    return drjit.scoped_set_flag(drjit.JitFlag.FastMath, False)
