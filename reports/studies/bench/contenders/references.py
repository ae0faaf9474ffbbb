"""Programs that render a scene as a whole, start and building included: Radiance, and POV-Ray where it is installed."""

from typing import Any, ClassVar

import numpy as np

from rayproof.cases.scene import Mesh, Scene
from rayproof.cases.stages import Stage
from rayproof.reference import REFERENCES
from rayproof.reports.studies.bench import CONTENDERS, Prepared

LARGEST = 50_000  # triangles; their scenes are text
MOST_PIXELS = 2**18  # a larger picture takes minutes


class _Whole:
    """A reference of the panel, asked for the radiance."""

    name: ClassVar[str]

    @classmethod
    def missing(cls) -> str | None:
        """Return why it cannot run here, or None."""
        if cls.name not in REFERENCES:
            return f"there is no reference {cls.name}"
        missing: Any = getattr(REFERENCES[cls.name], "missing", None)
        return missing() if missing is not None else None

    def unsupported(self, scene: Scene) -> str | None:
        """Return why it cannot draw this scene, or None."""
        triangles = sum(len(shape.faces) for shape in scene.shapes if isinstance(shape, Mesh))
        if triangles > LARGEST:
            return f"{triangles} triangles as text take minutes"
        if scene.camera.width * scene.camera.height > MOST_PIXELS:
            return "a picture of this size takes minutes"
        return REFERENCES[self.name]().unsupported(scene, Stage.RADIANCE)

    def prepare(self, scene: Scene) -> Prepared:
        """Load nothing: each run begins with the program's start."""
        reference = REFERENCES[self.name]()
        last: list[np.ndarray] = []

        def run() -> None:
            last[:] = [reference.render(scene, (Stage.RADIANCE,))[Stage.RADIANCE]]

        return Prepared(
            build_seconds=0.0,
            run=run,
            image=lambda: last[0].astype(np.float32),
            does="the whole program: start, building, a picture a light",
        )


@CONTENDERS.register("radiance")
class Radiance(_Whole):
    """Radiance's oconv and rtrace."""

    name = "radiance"


@CONTENDERS.register("povray")
class Povray(_Whole):
    """POV-Ray, its brackets included."""

    name = "povray"
