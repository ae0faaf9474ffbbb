"""Planted faults of references, for the audit; never in force outside of `with`.

To add one: in a new file, a context manager without parameters that spoils something while it is open, under
`@FAULTS.register("reference/what", where="reference", stage=...)`. `who` names the references that the fault spoils;
`stage` is the one that must be found wrong, `also` lists others that may be; `cases` are patterns of the cases that
show it.
"""

import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager
from types import ModuleType
from typing import Any

from rayproof.cases.registry import Registry

FAULTS: Registry[Callable[[], AbstractContextManager[None]]] = Registry(
    "planted fault", package="tests.harness.audit.faults"
)


# Put a wrong function in the place of a right one, wherever it was imported to, and back again.
#
# What a module keeps of earlier answers (`functools.cache`) goes both times: it came of what was there before.


@contextmanager
def replaced(right: Any, wrong: Any) -> Iterator[None]:
    """Replace `right` by `wrong` in every module of this project that holds it by name, until the block ends.

    Raises:
        LookupError: no module holds it, so that the fault would not be planted at all.

    """
    places = [
        (module, name)
        for module in list(sys.modules.values())
        if module.__name__.split(".")[0] in ("rayproof", "tests")
        for name, value in list(vars(module).items())
        if value is right and not name.startswith("__")
    ]
    if not places:
        raise LookupError(f"no module holds {right!r}")
    for module, name in places:
        setattr(module, name, wrong)
    _forget(module for module, _ in places)
    try:
        yield
    finally:
        for module, name in places:
            setattr(module, name, right)
        _forget(module for module, _ in places)


@contextmanager
def altered(owner: Any, name: str, wrong: Any) -> Iterator[None]:
    """Replace the attribute `name` of a class or module until the block ends."""
    right, module = vars(owner)[name], sys.modules[getattr(owner, "__module__", owner.__name__)]
    setattr(owner, name, wrong)
    _forget([module])
    try:
        yield
    finally:
        setattr(owner, name, right)
        _forget([module])


def _forget(modules: Iterable[ModuleType]) -> None:
    for module in modules:
        for value in list(vars(module).values()):
            # One that was imported is another module's.
            if getattr(value, "__module__", None) == module.__name__ and hasattr(value, "cache_clear"):
                value.cache_clear()
