"""Planted fault: a key goes by the code that somebody listed, and not by all that this imports."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rayproof.reports.cache import closure
from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced


@FAULTS.register("run/code_by_hand", where="run", stage=None)
@contextmanager
def code_by_hand() -> Iterator[None]:
    """Take what lies in the same folders for all that is imported."""
    right = closure.closure

    def wrong(modules: Any, *, without: Any = ()) -> Any:
        right(modules)
        folders = {module.rpartition(".")[0].replace(".", "/") for module in modules}
        return tuple(sorted(path for folder in folders for path in (closure.ROOT / folder).rglob("*.py")))

    with replaced(right, wrong):
        yield
