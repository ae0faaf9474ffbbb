"""Ladders: ill-conditioned sweeps as data, each with its condition number, predicted slope and first victim.

To add one: a `Ladder` in the list `LADDERS` of the file of its group, or of a new file. Renders nothing: what a
formula makes of the inputs is measured in `reports.studies.stability`.
"""

import importlib
import pkgutil

from rayproof.cases.ladders.ladder import Ladder


def all_ladders() -> tuple[Ladder, ...]:
    """Return every ladder of every group, in the order of the files' names and of their lists.

    Raises:
        ValueError: two ladders share a name.

    """
    found: dict[str, Ladder] = {}
    for module in sorted(pkgutil.iter_modules(__path__), key=lambda module: module.name):
        if module.ispkg:
            continue
        for ladder in getattr(importlib.import_module(f"{__name__}.{module.name}"), "LADDERS", ()):
            if ladder.name in found:
                raise ValueError(f"two ladders are called {ladder.name}")
            found[ladder.name] = ladder
    return tuple(found.values())
