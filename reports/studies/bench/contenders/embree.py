"""Embree by embreex: one thread, the primary rays and the feelers of a mesh, nothing shaded."""

import time
from importlib.util import find_spec

import numpy as np

from rayproof.cases.scene import Mesh, Scene
from rayproof.reference.embree import cameras
from rayproof.reports.studies.bench import CONTENDERS, Prepared


@CONTENDERS.register("embree")
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
        directions = cameras.directions(scene.camera)[0].astype(np.float32)
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
