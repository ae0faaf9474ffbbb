"""What judging asks of the analytic reference, and which stages a scene is asked about."""

from collections.abc import Collection
from typing import Any, Protocol

import numpy as np

from rayproof.cases.answers import Answers
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage

ORACLE = "analytic"  # its name among the references


class Surroundings(Protocol):
    """What is around n image points within a radius of each."""

    enclosed: np.ndarray  # (n,) whether the mesh that is seen goes on over the whole radius
    points: np.ndarray  # (k,) of each face near one of the points: which point
    places: np.ndarray  # (k, 2, 2) px, and two image points on the face


class Near(Protocol):
    """Lower bounds of how near to n image points something else is."""

    shadows: np.ndarray  # (n, lights) px: on the surface seen, to where a shadow of a light begins or ends
    seams: np.ndarray  # (n, lights) px: to where the way to a light meets an edge inside a mesh that hides it
    gaps: np.ndarray  # (n,) m: along the ray from what is seen to the nearest other surface


class FullOracle(Protocol):
    """What judging asks of the analytic reference."""

    def render(self, scene: Scene, stages: Collection[Stage], *, samples: int = 1) -> Answers:
        """Answer `stages`."""
        ...

    def at(self, scene: Scene, stages: Collection[Stage], points: np.ndarray) -> Answers:
        """Answer at image points (n, 2)."""
        ...

    def continue_from(self, scene: Scene, stage: Stage, given: Answers) -> np.ndarray:
        """Return the stage computed from the given previous ones."""
        ...

    def edges(self, scene: Scene) -> Any:
        """Return each pixel's distance to the nearest edges [px], as `reports.judge.tolerance.edges.Edges`."""
        ...

    def surroundings(self, scene: Scene, points: np.ndarray, radius: np.ndarray) -> Surroundings:
        """Return which faces come within a radius (n,) [px] of image points (n, 2), and whether one mesh fills it."""
        ...

    def near(self, scene: Scene, points: np.ndarray) -> Near:
        """Return how near to image points (n, 2) shadows' edges, inner edges of blockers and other surfaces are."""
        ...


def stages_of(scene: Scene) -> tuple[Stage, ...]:
    """Return the stages that a scene needs: without lights there is no light to ask about."""
    stages = tuple(Stage)
    return stages if scene.lights else stages[: stages.index(Stage.VISIBILITY)]
