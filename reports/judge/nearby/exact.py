"""`ExactOracle`: the oracle with what is hit first and what blocks a light decided by certified arithmetic.

float64 does not tell which of two surfaces comes first that are a few units of its own roundoff apart. For subjects in
float64, and before anything is failed by a few pixels, exact mathematics does.
"""

from collections.abc import Mapping

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Analytic, Freedom, Hits
from rayproof.reference.certified.stages import continued


class ExactOracle(Analytic):
    """What is hit and what is visible by exact mathematics on each step's numbers, the rest as the oracle has it."""

    def nearest(self, scene: Scene, directions: np.ndarray, freedom: Freedom | None = None) -> Hits:
        """Return what rays meet first; which of coinciding surfaces is left open as for the oracle."""
        if freedom is not None and (np.any(freedom.tie) or freedom.near):
            return super().nearest(scene, directions, freedom)
        rows = {Stage.RAY: directions}
        objects = continued(scene, Stage.OBJECT, rows)
        undecided = np.asarray(np.isnan(objects).any(axis=1))
        hits = super().nearest(scene, directions, freedom)
        objects = np.where(undecided[:, np.newaxis], hits.objects, objects)
        rows[Stage.OBJECT] = objects
        distances = self.distances(scene, directions, objects)
        rows[Stage.POSITION] = self.positions(scene, directions, objects, distances[:, np.newaxis])
        return Hits(objects, distances, self.pieces_at(scene, rows))

    def visibility(self, scene: Scene, rows: Mapping[Stage, np.ndarray], freedom: Freedom | None = None) -> np.ndarray:
        """Return which lights are visible from where shadow rays start."""
        if freedom is not None and (np.any(freedom.blind) or freedom.light or np.any(freedom.plane)):
            return super().visibility(scene, rows, freedom)
        starts = self.shadow_starts(scene, rows, 0.0 if freedom is None else freedom.lift)
        answer = continued(scene, Stage.VISIBILITY, dict(rows) | {Stage.POSITION: starts})
        return np.where(np.isnan(answer), super().visibility(scene, rows, freedom), answer)
