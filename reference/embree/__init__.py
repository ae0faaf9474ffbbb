"""Embree as a reference: which triangle a ray meets first, and whether one lies in between."""

from collections.abc import Collection
from functools import cache
from importlib.metadata import version as installed_version
from importlib.util import find_spec

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage, StageImages


class Embree:
    """Intel's ray tracing kernels, on flat shapes alone; its word is which triangle is hit and which light is hidden.

    It decides in float32. The distance is not its own number: the plane of the triangle that it names is met again in
    float64, by the ray as it was meant, and position and normal follow from that; they are right to 1e-15 wherever its
    decision is. A feeler counts as blocked only if float64 finds the blocker that Embree names ahead of its start.
    """

    precision = "float32"
    in_bands = True

    @staticmethod
    def missing() -> str | None:
        """Return why it cannot run here and how to install it, or None."""
        return None if find_spec("embreex") is not None else "Embree is not installed; pip install embreex."

    def version(self) -> str:
        """Return program and version, for the report."""
        return _version()

    def unsupported(self, scene: Scene, stage: Stage) -> str | None:
        """Return a sentence that says why it cannot answer here, or None if it can."""
        from rayproof.reference.embree.refusals import refusal

        return self.missing() or refusal(scene, stage)

    def settings(self, scene: Scene) -> dict[str, str]:
        """Return what its answer depends on besides the scene."""
        from rayproof.reference.embree.stages import CLEARANCE

        return {
            "scene": "robust, triangles, relative to the eye",
            "feelers": f"from {CLEARANCE:.3g} of the distance to the eye",
        }

    def epsilon_at(self, seen: StageImages) -> np.ndarray:
        """Return how near [m] to a hit blockers do not count, (height, width), 0 on a miss."""
        from rayproof.reference.embree.stages import CLEARANCE

        distance = seen[Stage.DISTANCE][..., 0]
        return np.where(np.isfinite(distance), CLEARANCE * distance, 0.0)

    def render(self, scene: Scene, stages: Collection[Stage], *, samples: int = 1) -> StageImages:
        """Answer `stages` from ray to visibility.

        Raises:
            ValueError: samples > 1, which asks for a mean radiance.

        """
        from rayproof.reference.embree.stages import answers, rays

        if samples != 1:
            raise ValueError(f"Embree has no radiance to take the mean of over {samples} x {samples} samples")
        found = {Stage.RAY: rays(scene)} if Stage.RAY in stages else {}
        return found | answers(scene, stages) if set(stages) - {Stage.RAY} else found


@cache
def _version() -> str:
    return f"Embree (embreex {installed_version('embreex')})"
