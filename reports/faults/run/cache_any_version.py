"""Planted fault: the reference cache takes another version's render, or one by other settings."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from reports.cache import references
from reports.faults import FAULTS
from reports.faults.patching import replaced


@FAULTS.register("run/cache_any_version", where="run", stage=None)
@contextmanager
def cache_any_version() -> Iterator[None]:
    """Leave version and settings out of the key."""
    right = references._key

    def wrong(about: Any, scene: Any) -> Any:
        return right({name: value for name, value in about.items() if name not in ("version", "settings")}, scene)

    with replaced(right, wrong):
        yield
