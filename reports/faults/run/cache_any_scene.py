"""Planted fault: the reference cache takes one scene's render for another's."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from reports.cache import references
from reports.faults import FAULTS
from reports.faults.patching import replaced
from reports.judge.sentinel import SCENE


@FAULTS.register("run/cache_any_scene", where="run", stage=None)
@contextmanager
def cache_any_scene() -> Iterator[None]:
    """Leave the scene's light, surfaces and camera out of the key."""
    right = references._key

    def wrong(about: Any, scene: Any) -> Any:
        return right(about, SCENE)

    with replaced(right, wrong):
        yield
