"""Planted fault: the reference cache believes an entry whatever its signature says."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rayproof.reports.cache import entries
from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced


@FAULTS.register("run/cache_believes_damage", where="run", stage=None)
@contextmanager
def cache_believes_damage() -> Iterator[None]:
    """Check nothing."""

    def wrong(data: Any, question: str, secret: bytes) -> None:
        return None

    with replaced(entries._check, wrong):
        yield
