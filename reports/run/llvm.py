"""Choosing the packaged LLVM for this process and every worker that it starts."""

from rayproof.tracer.kernel.compiler import select


def choose_packaged_llvm() -> None:
    """Point Dr.Jit, the tracer's and Mitsuba's alike, at the LLVM that came with the packages."""
    select()
