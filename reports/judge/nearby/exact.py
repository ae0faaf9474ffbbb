"""`ExactOracle`: the oracle with first hits and blockers decided by certified arithmetic.

float64 cannot decide which of two surfaces comes first if they are a few units of its roundoff apart. Exact arithmetic
decides for subjects in float64, and before a renderer fails by a few pixels.
"""

from collections.abc import Mapping

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Analytic, Freedom, Hits
from rayproof.reference.certified.stages import continued


class ExactOracle(Analytic):
    """The oracle with first hits and visibility computed exactly from the numbers of each step."""

    def nearest(self, scene: Scene, directions: np.ndarray, freedom: Freedom | None = None) -> Hits:
        """Return the first hits of rays; the choice among coinciding surfaces is free, as for the oracle."""
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
        """Return the mask of the lights that are visible from the starts of the shadow rays."""
        if freedom is not None and (np.any(freedom.blind) or freedom.light or np.any(freedom.plane)):
            return super().visibility(scene, rows, freedom)
        starts = self.shadow_starts(scene, rows, 0.0 if freedom is None else freedom.lift)
        answer = continued(scene, Stage.VISIBILITY, dict(rows) | {Stage.POSITION: starts})
        return np.where(np.isnan(answer), super().visibility(scene, rows, freedom), answer)
