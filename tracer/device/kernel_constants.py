"""A scene's numbers in a kernel: part of the code where one scene is rendered often, in memory where many are once.

As literals they save a load each and fold where they can, and every scene compiles a kernel of its own. In memory, the
scenes of one structure share a kernel: what a scene does not need, such as a transform that is the identity or a
coefficient that is 0, is left out either way. Where several stages are asked for, and written to memory, each may begin
from there: its kernel is then shared by scenes and configurations that differ in another stage. Each unrolled shape is
such a stage, so that scenes share its kernel whatever their number of shapes. docs/performance.md has what all of this
costs.
"""

from typing import Any, Protocol

import drjit as dr


class KernelConstants(Protocol):
    """What turns numbers into what a kernel is traced with."""

    shared: bool  # whether kernels are to be short and the same for as many scenes as possible

    def __call__(self, name: str, value: Any) -> Any:
        """Return the Dr.Jit literal `value`, a number, vector or matrix; `name` is its own and says what it is."""
        ...

    def store(self, *values: Any) -> None:
        """Let a kernel end here, if kernels are to be shared, with `values` (any tree of arrays) in memory."""
        ...

    def per_lane(self, value: Any, width: int) -> Any:
        """Return the value, if kernels are to be shared once for each of `width` lanes and in memory.

        Then it is the same code whether it differs from lane to lane, and whether a kernel has changed it before.
        """
        ...


class Literals:
    """Numbers that are part of the code."""

    shared = False

    def __call__(self, name: str, value: Any) -> Any:
        """Return the value as it is."""
        return value

    def store(self, *values: Any) -> None:
        """Let the kernel go on."""

    def per_lane(self, value: Any, width: int) -> Any:
        """Return the value as it is."""
        return value


class Numbers(Literals):
    """Numbers that are read from memory."""

    def __init__(self) -> None:
        self._kept: dict[tuple[str, type], Any] = {}

    def __call__(self, name: str, value: Any) -> Any:
        """Return the value in memory, the same for one name and type; a mask decides what is computed, and stays."""
        if dr.is_mask_v(value):
            return value
        key = (name, type(value))
        if key not in self._kept:
            copied = type(value)(value)
            dr.make_opaque(copied)
            self._kept[key] = copied
        return self._kept[key]


class Stages(Numbers):
    """Numbers that are read from memory, and what a stage hands to the next as well."""

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
