"""Planted faults of references, loader, judge, run and report, for `rayproof audit`; never in force outside of `with`.

To add one: in a new file, a context manager without parameters that spoils something while it is open, under
`@FAULTS.register("where/what", where=..., stage=...)`. `where` is "reference", "loader", "judge", "run" or "report";
`who` names the references that the fault spoils; `stage` is the one that must be found wrong (None: the guards must),
`also` lists others that may be; `cases` are patterns of the cases that show it.
"""

from collections.abc import Callable
from contextlib import AbstractContextManager

from rayproof.cases.registry import Registry

FAULTS: Registry[Callable[[], AbstractContextManager[None]]] = Registry(
    "planted fault", package="rayproof.reports.audit.faults"
)
