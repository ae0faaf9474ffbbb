"""The oracle with what it answers about one scene kept, so that many faults are judged for the price of one."""

from collections.abc import Collection
from typing import Any

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage, StageImages
from rayproof.reference.analytic import Analytic


class PatientOracle:
    """The analytic reference, its edges computed once a scene."""

    def __init__(self) -> None:
        self._oracle = Analytic()
        self.surroundings, self.near = self._oracle.surroundings, self._oracle.near
        self._scene: Scene | None = None
        self._edges: Any = None

    def render(self, scene: Scene, stages: Collection[Stage], *, samples: int = 1) -> StageImages:
        """Answer `stages`."""
        return self._oracle.render(scene, stages, samples=samples)

    def at(self, scene: Scene, stages: Collection[Stage], points: np.ndarray) -> StageImages:
        """Answer at image points (n, 2)."""
        return self._oracle.at(scene, stages, points)

    def continue_from(self, scene: Scene, stage: Stage, given: StageImages) -> np.ndarray:
        """Return the stage computed from the given previous ones."""
        return self._oracle.continue_from(scene, stage, given)

    def edges(self, scene: Scene) -> Any:
        """Return each pixel's distance to the nearest edges [px]."""
        if self._scene is not scene:
            self._scene, self._edges = scene, self._oracle.edges(scene)
        return self._edges
