"""Put a wrong function in the place of a right one, wherever it was imported to, and back again."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

OURS = ("cases", "reference", "reports", "tracer")


@contextmanager
def replaced(right: Any, wrong: Any) -> Iterator[None]:
    """Replace `right` by `wrong` in every module of this project that holds it by name, until the block ends.

    Raises:
        LookupError: no module holds it, so that the fault would not be planted at all.

    """
    places = [
        (module, name)
        for module in list(sys.modules.values())
        if module.__name__.split(".")[0] in OURS
        for name, value in list(vars(module).items())
        if value is right and not name.startswith("__")
    ]
    if not places:
        raise LookupError(f"no module holds {right!r}")
    for module, name in places:
        setattr(module, name, wrong)
    try:
        yield
    finally:
        for module, name in places:
            setattr(module, name, right)


@contextmanager
def altered(owner: Any, name: str, wrong: Any) -> Iterator[None]:
    """Replace the attribute `name` of a class or module until the block ends."""
    right = vars(owner)[name]
    setattr(owner, name, wrong)
    try:
        yield
    finally:
        setattr(owner, name, right)
