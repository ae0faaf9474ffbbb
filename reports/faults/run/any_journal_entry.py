"""Planted fault: the journal hands out whatever result it has."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import altered
from rayproof.reports.run.journal import Journal


@FAULTS.register("run/any_journal_entry", where="run", stage=None)
@contextmanager
def any_journal_entry() -> Iterator[None]:
    """Return the first record for any key."""

    def wrong(journal: Any, key: str) -> Any:
        return next(iter(journal._done.values()), None)

    with altered(Journal, "finished", wrong):
        yield
