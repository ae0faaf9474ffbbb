"""Load Mitsuba in one of its variants; which one is in force is global to the process."""

from importlib.metadata import version as installed_version
from importlib.util import find_spec
from typing import Any


def load(variant: str) -> Any:
    """Return the module `mitsuba` switched to `variant`.

    Objects made under another variant stay valid but do not mix with those made afterwards, so every render
    switches first and keeps nothing.
    """
    import mitsuba

    mitsuba.set_variant(variant)
    return mitsuba


def unavailable(variant: str) -> str | None:
    """Return a sentence that says why the variant cannot run on this machine, or None if it can."""
    if find_spec("mitsuba") is None:
        return "Mitsuba is not installed; pip install mitsuba."
    if variant.startswith("llvm"):
        import drjit

        # Asked first, because using the backend without a library kills the process.
        if not drjit.has_backend(drjit.JitBackend.LLVM):
            return "Dr.Jit finds no LLVM library that it accepts; set DRJIT_LIBLLVM_PATH to one, version 17 or later."
    return None


def version(variant: str) -> str:
    """Return program, version and variant."""
    # Importing Mitsuba takes longer than all else that a run does before its first render.
    return f"Mitsuba {installed_version('mitsuba')} ({variant})"
