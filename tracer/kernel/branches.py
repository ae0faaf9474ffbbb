"""How a kernel's code is laid out: branches that a packet goes past, and steps of the samples side by side.

Code that a packet goes past where none of its lanes asks for it.

A processor takes eight or sixteen lanes at a time: what one of them asks for, all of them pay.

The samples of a lane side by side: a step of all of them comes before the next step of any.

Dr.Jit writes the code of one scope before that of the next, and within a scope follows each result back to where it
came from, one sample after the other. A sample's operations wait for each other, and a processor looks some two
hundred instructions ahead, less than one sample has: step by step it finds other samples' work to do meanwhile.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

import drjit as dr

from rayproof.tracer.kernel.arrays import BACKENDS, ArrayTypes

_ASKED: ContextVar[list[Any] | None] = ContextVar("asked", default=None)  # where it is written down, if anywhere


def where(some: Any, compute: Callable[[], list[Any]], otherwise: list[Any]) -> list[Any]:
    """Return what is computed, in packets with a lane where `some` is true; in the others, and lanes, `otherwise`."""
    found = _ASKED.get()
    if found is not None:
        found.append(some)
        return compute()
    # Dr.Jit writes its result into what the branches return: an array that is there twice would get both.
    return dr.if_stmt((), some, compute, lambda: [type(one)(one) for one in otherwise])


@contextmanager
def asked() -> Iterator[list[Any]]:
    """Collect what `where` is asked, in the order of the code, and compute everything everywhere."""
    found: list[Any] = []
    token = _ASKED.set(found)
    try:
        yield found
    finally:
        _ASKED.reset(token)


def next_step(types: ArrayTypes, *, samples: int) -> None:
    """End a step: what is computed from here on comes later in the kernel than all that was computed before.

    A lane of one sample has nothing to put beside it.
    """
    if samples > 1:
        dr.detail.new_scope(BACKENDS[types.backend])
