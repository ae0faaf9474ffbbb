"""`Search`: the smallest scene so far, its size, and attempts within limits of time and number."""

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from rayproof.cases.scene import Cube, Mesh, Scene, SceneError
from rayproof.cases.scene_json import scene_to_json
from rayproof.reports.shrinking.failure import Renderer, SceneFailure, failure

TRIES = 200  # renders
CUBE = 6  # faces of a cube

Size = tuple[int, ...]


class SpentError(Exception):
    """The limit of renders or of time is reached."""


@dataclass(frozen=True, kw_only=True)
class SearchLimits:
    """The limits of a search. A number of renders gives the same scene on every machine; a time [s] does not."""

    tries: int = TRIES
    seconds: float | None = None


@dataclass(kw_only=True)
class Search:
    """The smallest scene so far with the same failure, and the number of renders so far."""

    scene: Scene
    failure: SceneFailure
    render: Renderer
    limits: SearchLimits
    progress: Callable[["Search"], None] = lambda search: None
    tries: int = 1  # includes the render of the original scene
    interrupted: bool = False  # by Ctrl-C
    started: float = field(default_factory=time.perf_counter)
    _tried: set[str] = field(default_factory=set)

    def attempt(self, build: Callable[[], Scene | None]) -> bool:
        """Take the scene that `build` returns if it is smaller and has the same failure; return whether it was taken.

        A scene that cannot be built, for example since its matrix would be singular, is not taken.

        Raises:
            SpentError: the limit of renders or of time is reached.

        """
        try:
            with np.errstate(all="ignore"):
                scene = build()
        except (SceneError, OverflowError, np.linalg.LinAlgError):
            return False
        if scene is None or not size(scene) < size(self.scene):
            return False
        text = repr(scene_to_json(scene))
        if text in self._tried:
            return False
        spent = self.limits.seconds is not None and time.perf_counter() - self.started > self.limits.seconds
        if self.tries >= self.limits.tries or spent:
            raise SpentError
        self._tried.add(text)
        self.tries += 1
        candidate = failure(scene, self.render, self.failure.stage)
        if candidate is not None and self.failure.same(candidate):
            self.scene, self.failure = scene, candidate
        self.progress(self)
        return self.scene is scene

    def first(self, builds: Sequence[Callable[[], Scene | None]]) -> bool:
        """Take the first of several scenes that is smaller and has the same failure; return whether one was taken."""
        return any(self.attempt(build) for build in builds)


Step = Callable[[Search], None]


def size(scene: Scene) -> Size:
    """Return a scene's size, in order of priority: pixels, shapes, lights, faces, and other fields plus digits."""
    document = scene_to_json(scene)
    faces = sum(
        len(shape.faces) if isinstance(shape, Mesh) else CUBE if isinstance(shape, Cube) else 1
        for shape in scene.shapes
    )
    odd = [scene.clip != "depth", scene.shading != "inverse_square", *(shape.two_sided for shape in scene.shapes)]
    pixels = scene.camera.width * scene.camera.height
    return (pixels, len(scene.shapes), len(scene.lights), faces, sum(odd) + sum(map(digits, _numbers(document))))


def _numbers(value: Any) -> Iterator[float]:
    """Yield all numbers of a scene's JSON."""
    if isinstance(value, dict):
        for key, member in value.items():
            if key in ("albedo", "flux"):
                yield from (number - 1 for number in _numbers(member))  # white is the simplest colour
            elif key not in ("faces", "width", "height"):
                yield from _numbers(member)
    elif isinstance(value, list | tuple | np.ndarray):
        for member in value:
            yield from _numbers(member)
    elif isinstance(value, int | float) and not isinstance(value, bool):
        yield float(value)


def digits(number: float) -> int:
    """Return the number of characters of a number, without sign and ".0"; 0 for the number 0."""
    return 0 if number == 0 else len(f"{abs(number)!r}".removesuffix(".0"))
