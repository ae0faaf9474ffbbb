"""Planted faults: the reference cache takes one render for another: of another scene, camera, version or settings."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

from rayproof.reports.cache import references
from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import altered
from rayproof.reports.judge.sentinel import SCENE


@contextmanager
def _key_is(wrong: Callable[[Any], Any]) -> Iterator[None]:
    """Change every key of a render."""
    right = references.Question.key.func
    with altered(references.Question, "key", property(lambda question: wrong(right(question)))):
        yield


@FAULTS.register("run/cache_any_scene", where="run", stage=None)
def cache_any_scene() -> Any:
    """Leave the scene's light, surfaces and camera out of the key."""
    return _key_is(lambda key: replace(key, scene=SCENE))


@FAULTS.register("run/cache_any_camera", where="run", stage=None)
def cache_any_camera() -> Any:
    """Leave the camera out of the key."""
    return _key_is(lambda key: replace(key, scene=replace(key.scene, camera=SCENE.camera)))


@FAULTS.register("run/cache_any_version", where="run", stage=None)
def cache_any_version() -> Any:
    """Leave version and settings out of the key."""
    return _key_is(lambda key: replace(key, version="", settings={}))
