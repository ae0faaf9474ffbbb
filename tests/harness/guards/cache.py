"""The reference cache's guard: the same question is answered from it, another one or a damaged entry is not."""

import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage, StageImages
from rayproof.reports.judge.limit_sentinels import SCENE
from rayproof.reports.run.cache_store import Store
from rayproof.reports.run.reference_cache import ReferenceQuestion, Rendered, cached
from tests.harness.guards import BrokenHarnessError

HEIGHT, WIDTH = 3, 4


class _Known:
    """A reference whose answers are counted: each render's numbers tell which one it was."""

    precision = "float64"

    def __init__(self) -> None:
        self.asked = 0
        self.edition, self.chosen = "1", "a"

    def version(self) -> str:
        """Return its version."""
        return self.edition

    def settings(self, scene: Scene) -> dict[str, str]:
        """Return its settings."""
        return {"chosen": self.chosen}

    def render(self) -> tuple[StageImages, None]:
        """Return an image of the number of this render."""
        self.asked += 1
        return {Stage.RADIANCE: np.full((HEIGHT, WIDTH, 3), float(self.asked))}, None

    def unsupported(self, scene: Scene, stage: Stage) -> str | None:
        """Return None."""
        return None


def guard_cache() -> None:
    """Ask a cache of our own the same, other and damaged questions; raise BrokenHarnessError for a wrong answer."""
    with tempfile.TemporaryDirectory() as folder:
        _ask_about(Store(Path(folder)))


def _ask_about(store: Store) -> None:
    known = _Known()

    def ask(scene: Scene = SCENE) -> Rendered:
        question = ReferenceQuestion(name="known", reference=known, scene=scene, stages=(Stage.RADIANCE,), samples=1)  # type: ignore[arg-type]
        return cached(question, known.render, store=store, always=True)

    _expect(ask(), 1, "the first question")
    _expect(ask(), 1, "the same question again")
    dimmer = replace(SCENE.lights[0], flux=(1.0, 1.0, 1.0))
    _expect(ask(replace(SCENE, lights=(dimmer,))), 2, "another scene")
    known.edition = "2"
    _expect(ask(), 3, "another version")
    known.chosen = "b"
    _expect(ask(), 4, "other settings")
    for item in store.items():
        data = bytearray(item.path.read_bytes())
        data[-1] ^= 1
        item.path.write_bytes(bytes(data))
    _expect(ask(), 5, "an altered entry")


def _expect(found: Rendered, number: int, what: str) -> None:
    """Raise unless an answer is that of the render that must have given it."""
    image = found.answers[Stage.RADIANCE]
    if not np.array_equal(image, np.full((HEIGHT, WIDTH, 3), float(number))):
        raise BrokenHarnessError(
            f"the reference cache is broken: {what} must be answered by render {number}, got {image.flat[0]:g}"
        )
