"""Code that a packet goes past where none of its lanes asks for it.

A processor takes eight or sixteen lanes at a time: what one of them asks for, all of them pay.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

import drjit as dr

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
