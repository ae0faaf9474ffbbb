"""`ORACLE`, the analytic reference with its edges as judging asks it, and the stages that a scene is asked about."""

from collections.abc import Collection
from typing import Any, Protocol

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage, StageImages

ORACLE = "analytic"  # its name among the references


class FullOracle(Protocol):
    """The questions of the judge to the analytic reference."""

    def render(self, scene: Scene, stages: Collection[Stage], *, samples: int = 1) -> StageImages:
        """Answer `stages`."""
        ...

    def at(self, scene: Scene, stages: Collection[Stage], points: np.ndarray) -> StageImages:
        """Answer at image points (n, 2)."""
        ...

    def continue_from(self, scene: Scene, stage: Stage, given: StageImages) -> np.ndarray:
        """Return the stage computed from the given previous ones."""
        ...

    def edges(self, scene: Scene) -> Any:
        """Return each pixel's distance to the nearest edges [px], as `reports.judge.edge_values.Edges`."""
        ...

    def surroundings(self, scene: Scene, points: np.ndarray, radius: np.ndarray) -> Any:
        """Return what is around image points (n, 2) within a radius (n,) [px] of each.

        `enclosed` (n,) says where the mesh that is seen goes on over the whole radius; `points` (k,) of each face of a
        mesh that comes near one of the points which one that is, and `places` (k, 2, 2) [px] are two points on it.
        """
        ...

    def near(self, scene: Scene, points: np.ndarray) -> Any:
        """Return lower bounds of how near to image points (n, 2) something else is, on the surface seen there.

        `shadows` (n, lights) [px] where one begins or ends, `seams` (n, lights) [px] where the way to a light meets an
        edge inside a mesh that hides it, `gaps` (n,) [m] along the ray to the nearest other surface.
        """
        ...


def stages_of(scene: Scene) -> tuple[Stage, ...]:
    """Return the stages that a scene needs: without lights there is no light to ask about."""
    stages = tuple(Stage)
    return stages if scene.lights else stages[: stages.index(Stage.VISIBILITY)]
