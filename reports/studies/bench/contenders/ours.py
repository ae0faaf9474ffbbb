"""The tracer: frames of one scene, warm and frozen, as `tracer.frames` makes them."""

import time
from typing import Any

import drjit as dr
import numpy as np

from rayproof.cases.scene import Scene
from rayproof.reports.studies.bench import CONTENDERS, Prepared
from rayproof.reports.studies.bench.kernels import fastest
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.frames import Frames

REPETITIONS = 9  # frames, of which the fastest one's kernels are held against the machine's limit


class _Ours:
    """The tracer's default formulas in one precision."""

    precision = "float32"

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
        frames = Frames(scene, Configuration(precision=self.precision))
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
            does=f"one frozen frame, {self.precision}",
            kernels=lambda: fastest(run, times=REPETITIONS),
            asked=frames.asked,
        )


@CONTENDERS.register("ours")
class Ours(_Ours):
    """Single precision."""


@CONTENDERS.register("ours_again")
class OursAgain(_Ours):
    """The same once more: the control, whose ratio to ours must be 1."""


@CONTENDERS.register("ours_float64")
class OursDouble(_Ours):
    """Double precision."""

    precision = "float64"
