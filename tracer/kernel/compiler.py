"""The choice of the LLVM library that Dr.Jit loads, and the number of its threads.

The LLVM of the installed packages is preferred to that of the system.

LLVM 15 and 16 abort the process on float minimum and maximum, and LLVM 15 on float64 kernels; Dr.Jit would take the
newest library that it finds. Imports no Dr.Jit, because Dr.Jit loads LLVM when it is imported.
"""

import ctypes
import os
import platform
import struct
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

VARIABLE = "DRJIT_LIBLLVM_PATH"
NAMES = {"darwin": ("lib/libLLVM.dylib",), "win32": ("Library/bin/LLVM-C.dll", "bin/LLVM-C.dll")}


OLDEST = (17,)  # the oldest version that compiles the tracer's kernels


class NoBackendError(RuntimeError):
    """Dr.Jit has no backend, or not the requested one."""


def packaged_library() -> Path | None:
    """Return the path of the LLVM library in this Python environment, or None if there is none."""
    candidates = (Path(sys.prefix) / name for name in NAMES.get(sys.platform, ("lib/libLLVM.so",)))
    return next((path for path in candidates if path.exists()), None)


def choose_packaged_llvm() -> None:
    """Make Dr.Jit load the packaged LLVM, unless DRJIT_LIBLLVM_PATH names another; call it before importing Dr.Jit.

    Raises:
        NoBackendError: Dr.Jit was imported before and has loaded a library that aborts the process.

    """
    library = packaged_library()
    if library is None or VARIABLE in os.environ:
        return
    loaded = sys.modules.get("drjit")
    version = tuple(loaded.detail.llvm_version()) if loaded is not None else ()
    if sum(version) > 0 and version < OLDEST:
        raise NoBackendError(
            f"Dr.Jit was imported before rayproof and loaded LLVM {'.'.join(map(str, version))}, "
            f"which aborts the process; import rayproof's packages first, or set {VARIABLE} to {library}"
        )
    os.environ[VARIABLE] = str(library)


# glibc's fenv_t on x86-64: where MXCSR is in it, and its bits that flush subnormal results and operands to zero.
FENV, MXCSR, FLUSH = 32, 28, 0x8040


@cache
def _libm() -> ctypes.CDLL | None:
    """Return the library that changes the calling thread's floating-point environment, or None elsewhere."""
    if not (sys.platform.startswith("linux") and platform.machine() == "x86_64" and platform.libc_ver()[0] == "glibc"):
        return None
    return ctypes.CDLL("libm.so.6")


@contextmanager
def one_thread() -> Iterator[None]:
    """Make Dr.Jit compute on the calling thread only while the body runs, with bit-identical results.

    The threads of its pool spin between kernels, which takes as long as the kernels of a small image. The calling
    thread must flush subnormal numbers to zero, as the threads of the pool do. If it cannot, the pool is used.
    """
    import drjit as dr

    libm, before = _libm(), ctypes.create_string_buffer(FENV)
    if libm is None or libm.fegetenv(before) != 0:
        yield
        return
    flushing, threads = ctypes.create_string_buffer(before.raw, FENV), dr.thread_count()
    struct.pack_into("<I", flushing, MXCSR, struct.unpack_from("<I", before, MXCSR)[0] | FLUSH)
    dr.set_thread_count(0)
    libm.fesetenv(flushing)
    try:
        yield
    finally:
        libm.fesetenv(before)
        dr.set_thread_count(threads)
