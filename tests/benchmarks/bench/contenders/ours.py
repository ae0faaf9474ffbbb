"""The tracer: frames of one scene, warm and frozen, as `tracer.frames` makes them."""

import time
from collections.abc import Mapping
from typing import Any, ClassVar

import drjit as dr
import numpy as np

from rayproof.cases.scene import Scene
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.frames import Frames
from tests.benchmarks.bench import Prepared
from tests.benchmarks.bench.kernels import fastest

REPETITIONS = 9  # frames, of which the fastest one's kernels are held against the machine's limit


class _Ours:
    """The tracer in one precision, by its default formulas and those that the benchmark is asked about."""

    precision = "float32"
    asked_about: ClassVar[Mapping[str, str]] = {}  # slot -> variant; each scene has a process, which sets it once
    by_default = False

    @classmethod
    def missing(cls) -> str | None:
        """Return why it cannot run here, or None."""
        return None if dr.has_backend(dr.JitBackend.LLVM) else "Dr.Jit finds no LLVM library that it accepts."

    def unsupported(self, scene: Scene) -> str | None:
        """Return why it cannot draw this scene, or None."""
        return None

    def prepare(self, scene: Scene) -> Prepared:
        """Load the scene."""
        start = time.perf_counter()
        formulas = {} if self.by_default else self.asked_about
        configuration = Configuration(precision=self.precision, formulas=formulas)
        frames = Frames(scene, configuration)
        seconds = time.perf_counter() - start
        last: list[Any] = [None]

        def run() -> None:
            last[0] = frames()
            dr.eval(last[0])
            dr.sync_thread()

        def image() -> np.ndarray:
            return np.array(last[0], dtype=np.float32).reshape(scene.camera.height, scene.camera.width, 3)

        return Prepared(
            build_seconds=seconds,
            run=run,
            image=image,
            does=f"one frozen frame, {configuration.name}",
            kernels=lambda: fastest(run, times=REPETITIONS),
            asked=frames.asked,
        )


def ask_about(configuration: Configuration) -> None:
    """Let the tracer take part with the formulas of a configuration."""
    _Ours.asked_about = configuration.formulas


class Ours(_Ours):
    """Single precision."""


class OursAgain(_Ours):
    """The same once more: the control, whose ratio to ours must be 1."""


class OursByDefault(_Ours):
    """The default formulas, where the benchmark is asked about others."""

    by_default = True


class OursDouble(_Ours):
    """Double precision."""

    precision = "float64"
