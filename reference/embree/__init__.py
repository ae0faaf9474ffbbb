"""Embree by embreex: the reference's class, and which scenes it refuses."""

from collections.abc import Collection
from functools import cache
from importlib.metadata import version as installed_version
from importlib.util import find_spec

import numpy as np

from rayproof.cases.scene import Cube, Mesh, Scene, Square, Triangle
from rayproof.cases.stages import Stage, StageImages
from rayproof.reference.embree.scene import facets

# Embree gets lengths over the largest coordinate; an eye or a light farther out than this many of those is beyond
# what it takes, and squares of lengths out of these bounds leave float64 beside it.
FARTHEST = 1e15
SMALLEST, LARGEST = 1e-140, 1e140  # m
GEOMETRY = (Stage.OBJECT, Stage.DISTANCE, Stage.POSITION, Stage.NORMAL, Stage.VISIBILITY)


def refusal(scene: Scene, stage: Stage) -> str | None:
    """Return why Embree cannot answer `stage` of `scene`, or None if it can."""
    if stage is Stage.CAMERA:
        return "Embree has no camera: it is handed rays."
    if stage is Stage.RAY:
        return None
    if stage not in GEOMETRY:
        return "Embree finds hits and blockers; it knows no light."
    for index, shape in enumerate(scene.shapes):
        if not isinstance(shape, Triangle | Mesh | Square | Cube):
            return f"Embree is asked about triangles alone, and shapes[{index}] is a {type(shape).__name__.lower()}."
    corners = np.abs(facets(scene).corners)
    size = float(corners.max(initial=0.0))
    lights = [float(np.abs(np.subtract(light.position, scene.camera.eye)).max()) for light in scene.lights]
    if size and not SMALLEST < size < LARGEST:
        return f"Squares of lengths of {size:g} m leave the range of the numbers that Embree's hits are continued in."
    if size and max(lights, default=0.0) > FARTHEST * size:
        return f"Embree's float32 does not reach a light at {max(lights):g} m from shapes within {size:g} m of the eye."
    return None


# Embree as a reference: which triangle a ray meets first, and whether one lies in between.


class Embree:
    """Intel's ray tracing kernels, on flat shapes alone; its word is which triangle is hit and which light is hidden.

    It decides in float32. The distance is not its own number: the plane of the triangle that it names is met again in
    float64, by the ray as it was meant, and position and normal follow from that; they are right to 1e-15 wherever its
    decision is. A feeler counts as blocked only if float64 finds the blocker that Embree names ahead of its start.
    """

    precision = "float32"

    @staticmethod
    def missing() -> str | None:
        """Return why it cannot run here and how to install it, or None."""
        return None if find_spec("embreex") is not None else "Embree is not installed; pip install embreex."

    def version(self) -> str:
        """Return program and version, for the report."""
        return _version()

    def unsupported(self, scene: Scene, stage: Stage) -> str | None:
        """Return a sentence that says why it cannot answer here, or None if it can."""
        return self.missing() or refusal(scene, stage)

    def settings(self, scene: Scene) -> dict[str, str]:
        """Return what its answer depends on besides the scene."""
        from rayproof.reference.embree.program import CLEARANCE

        return {
            "scene": "robust, triangles, relative to the eye",
            "feelers": f"from {CLEARANCE:.3g} of the distance to the eye",
        }

    def epsilon_at(self, seen: StageImages) -> np.ndarray:
        """Return how near [m] to a hit blockers do not count, (height, width), 0 on a miss."""
        from rayproof.reference.embree.program import CLEARANCE

        distance = seen[Stage.DISTANCE][..., 0]
        return np.where(np.isfinite(distance), CLEARANCE * distance, 0.0)

    def render(self, scene: Scene, stages: Collection[Stage], *, samples: int = 1) -> StageImages:
        """Answer `stages` from ray to visibility.

        Raises:
            ValueError: samples > 1, which asks for a mean radiance.

        """
        from rayproof.reference.embree.program import answers, rays

        if samples != 1:
            raise ValueError(f"Embree has no radiance to take the mean of over {samples} x {samples} samples")
        found = {Stage.RAY: rays(scene)} if Stage.RAY in stages else {}
        return found | answers(scene, stages) if set(stages) - {Stage.RAY} else found


@cache
def _version() -> str:
    return f"Embree (embreex {installed_version('embreex')})"
