"""Radiance and POV-Ray as whole programs, start and building included; Embree for the rays of a mesh alone."""

import time
from importlib.util import find_spec
from typing import Any, ClassVar

import numpy as np

from rayproof.cases.scene import Mesh, Scene
from rayproof.cases.stages import Stage
from rayproof.reference import REFERENCES
from rayproof.reference.embree import scene as embree_scene
from tests.benchmarks.bench import Prepared

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


class Radiance(_Whole):
    """Radiance's oconv and rtrace."""

    name = "radiance"


class Povray(_Whole):
    """POV-Ray, its brackets included."""

    name = "povray"


# Embree by embreex: one thread, the primary rays and the feelers of a mesh, nothing shaded.


class Embree:
    """Intel's kernels behind embreex: which triangle each camera ray meets, and which feelers are blocked."""

    @classmethod
    def missing(cls) -> str | None:
        """Return why it cannot run here, or None."""
        return None if find_spec("embreex") is not None else "Embree is not installed; pip install embreex."

    def unsupported(self, scene: Scene) -> str | None:
        """Return why it cannot trace this scene, or None."""
        return None if all(isinstance(shape, Mesh) for shape in scene.shapes) else "it traces triangles only"

    def prepare(self, scene: Scene) -> Prepared:
        """Build its tree, and the camera's rays."""
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene

        start = time.perf_counter()
        world = EmbreeScene()
        for shape in scene.shapes:
            assert isinstance(shape, Mesh)
            TriangleMesh(world, np.ascontiguousarray(shape.vertices[shape.faces]))
        # It builds at the first ray.
        world.run(np.zeros((1, 3), np.float32), np.ones((1, 3), np.float32))
        seconds = time.perf_counter() - start
        eye = np.asarray(scene.camera.eye, np.float32)
        directions = embree_scene.directions(scene.camera)[0].astype(np.float32)
        origins = np.ascontiguousarray(np.broadcast_to(eye, directions.shape))

        def run() -> None:
            distance = world.run(origins, directions, query="DISTANCE")
            met = distance < 1e30
            points = origins[met] + distance[met, np.newaxis] * directions[met] * np.float32(1 - 1e-4)
            for light in scene.lights:
                world.run(points, np.asarray(light.position, np.float32) - points, query="OCCLUDED")

        return Prepared(
            build_seconds=seconds, run=run, image=None, does="primary rays and feelers, one thread, no shading"
        )
