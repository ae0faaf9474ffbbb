"""Choose the LLVM that comes with the packages, ahead of any that the system has.

LLVM 15 and 16 abort the process on float minimum and maximum, and LLVM 15 on float64 kernels; Dr.Jit would take the
newest library that it finds. Imports no Dr.Jit, because Dr.Jit loads LLVM when it is imported.
"""

import os
import sys
from pathlib import Path

VARIABLE = "DRJIT_LIBLLVM_PATH"
NAMES = {"darwin": ("lib/libLLVM.dylib",), "win32": ("Library/bin/LLVM-C.dll", "bin/LLVM-C.dll")}


OLDEST = (17,)  # that compiles what the tracer needs


class NoBackendError(RuntimeError):
    """Dr.Jit has no backend to compute with, or not the one that was asked for."""


def packaged_library() -> Path | None:
    """Return the path of the LLVM library in this Python environment, or None if there is none."""
    candidates = (Path(sys.prefix) / name for name in NAMES.get(sys.platform, ("lib/libLLVM.so",)))
    return next((path for path in candidates if path.exists()), None)


def select() -> None:
    """Make Dr.Jit load the packaged LLVM, unless DRJIT_LIBLLVM_PATH names another; call it before importing Dr.Jit.

    Raises:
        NoBackendError: Dr.Jit was imported already and took one that aborts the process.

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
