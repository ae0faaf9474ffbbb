"""Radiance as a whole program, start and building included."""

import numpy as np

from rayproof.cases.scene import Mesh, Scene
from rayproof.cases.stages import Stage
from rayproof.reference.radiance import Radiance as Reference
from tests.benchmarks.bench import Prepared

LARGEST = 50_000  # triangles; their scenes are text
MOST_PIXELS = 2**18  # a larger picture takes minutes


class Radiance:
    """Radiance's oconv and rtrace, asked for the radiance as the panel does."""

    @classmethod
    def missing(cls) -> str | None:
        """Return why it cannot run here, or None."""
        return Reference.missing()

    def unsupported(self, scene: Scene) -> str | None:
        """Return why it cannot draw this scene, or None."""
        triangles = sum(len(shape.faces) for shape in scene.shapes if isinstance(shape, Mesh))
        if triangles > LARGEST:
            return f"{triangles} triangles as text take minutes"
        if scene.camera.width * scene.camera.height > MOST_PIXELS:
            return "a picture of this size takes minutes"
        return Reference().unsupported(scene, Stage.RADIANCE)

    def prepare(self, scene: Scene) -> Prepared:
        """Load nothing: each run begins with the program's start."""
        reference = Reference()
        last: list[np.ndarray] = []

        def run() -> None:
            last[:] = [reference.render(scene, (Stage.RADIANCE,))[Stage.RADIANCE]]

        return Prepared(
            build_seconds=0.0,
            run=run,
            image=lambda: last[0].astype(np.float32),
            does="the whole program: start, building, a picture a light",
        )
