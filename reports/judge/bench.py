"""The bench at which one candidate is judged against one witness: each stage measured once, on the pair's terms."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cases.stages import Stage, upto
from reports.judge.channels import all_of
from reports.judge.ground import Ground
from reports.judge.measurement import Measurement, measure, ratios
from reports.judge.parties import Candidate, Witness
from reports.judge.sides import Sides, excused, excused_anyhow, sides, with_twins
from reports.judge.terms import Terms

GEOMETRY = (Stage.OBJECT, Stage.DISTANCE, Stage.POSITION, Stage.NORMAL)


@dataclass(frozen=True, kw_only=True)
class Bench:
    """One candidate before one witness, on the ground of the oracle's truth, whoever the witness is."""

    ground: Ground
    candidate: Candidate
    witness: Witness

    @cached_property
    def terms(self) -> Terms:
        """Return the limits and pixel classes of the two."""
        return Terms(ground=self.ground, candidate=self.candidate, witness=self.witness)

    @cached_property
    def _sides(self) -> Sides:
        """Return the oracle's answers around every edge pixel."""
        assert self.candidate.answers is not None
        asked = {Stage.OBJECT, *self.candidate.answers}
        scene, truth, oracle, classes = self.ground.scene, self.ground.truth, self.ground.oracle, self.terms.classes
        stages = tuple(stage for stage in GEOMETRY if stage in asked and stage in truth)
        around = self.ground.once(
            ("sides", stages),
            (classes.outline, classes.reach),
            lambda: sides(oracle, scene, stages, classes.outline, classes.reach),
        )
        if Stage.OBJECT not in self.candidate.answers:
            return around
        return with_twins(around, oracle, scene, truth, self.candidate.answers, classes.depth)

    def _excused(
        self, stage: Stage, ratio: np.ndarray, limit: np.ndarray, edge: np.ndarray, *, continued: bool
    ) -> np.ndarray:
        """Return the edge pixels that have a side's value; the oracle is asked only if an edge pixel differs at all."""
        assert self.candidate.answers is not None
        if not np.any(edge & (ratio > 1)):
            return np.zeros(edge.shape, dtype=bool)
        if Stage.OBJECT not in self.candidate.answers:
            return excused_anyhow(stage, self.candidate.answers, self._sides, limit, edge.shape, continued=continued)
        return excused(stage, self.candidate.answers, self._sides, limit, edge.shape, continued=continued)

    def end_to_end(self, stage: Stage) -> Measurement:
        """Measure the candidate's stage against the witness's own; once for candidates that are equal in it."""
        ours, theirs = self.candidate.answers, self.witness.answers[stage]
        assert ours is not None
        # At an edge what the candidate sees there decides which sides its value may be.
        seen = tuple(ours.get(one) for one in (Stage.RAY, *GEOMETRY))
        return self.ground.once(
            ("end to end", stage, self.terms.rules), (ours[stage], theirs, *seen), lambda: self._end_to_end(stage)
        )

    def _end_to_end(self, stage: Stage) -> Measurement:
        assert self.candidate.answers is not None
        classes = self.terms.classes
        shape = classes.outline.shape
        limit = self.terms.limits.end_to_end.get(stage, np.zeros(shape))
        edge = classes.edge(stage)
        theirs, compared = np.asarray(self.witness.answers[stage], dtype=np.float64), None
        if stage in GEOMETRY:
            compared = ratios(stage, self._ours(stage), theirs, limit)
            good = self._excused(stage, compared[0], limit, edge, continued=False)
        else:
            good = np.ones(shape, dtype=bool) if self._finite(stage) else all_of(np.isfinite(self._ours(stage)))
        return self._measure(stage, theirs, limit, edge, good, compared)

    def _ours(self, stage: Stage) -> np.ndarray:
        assert self.candidate.answers is not None
        return self.candidate.answers[stage]

    def _finite(self, stage: Stage) -> bool:
        """Say whether all of the candidate's stage is finite; asked once of an image, whoever it is held against."""
        ours = self._ours(stage)
        return self.ground.once(("finite",), (ours,), lambda: bool(np.isfinite(ours).all()))

    def inside(self, stage: Stage) -> np.ndarray:
        """Return error over limit end to end, (height, width), 0 at edges: what is judged strictly."""
        classes = self.terms.classes
        limit = self.terms.limits.end_to_end.get(stage, np.zeros(classes.outline.shape))
        theirs = np.asarray(self.witness.answers[stage], dtype=np.float64)
        ratio = ratios(stage, self._ours(stage), theirs, limit)[0]
        return np.where(classes.edge(stage) | self.terms.near, 0.0, ratio)

    def continued(self, stage: Stage, value: np.ndarray) -> Measurement:
        """Measure the candidate's stage against `value`, which the oracle made from the candidate's own stages."""
        assert self.candidate.answers is not None
        ours = tuple(self.candidate.answers.get(one) for one in upto(stage) if one is not Stage.CAMERA)
        return self.ground.once(
            ("continued", stage, self.terms.rules), (value, *ours), lambda: self._continued(stage, value)
        )

    def _continued(self, stage: Stage, value: np.ndarray) -> Measurement:
        limit, edge = self.terms.continued(stage, value)
        good, value, compared = np.ones(edge.shape, dtype=bool), np.asarray(value, dtype=np.float64), None
        if stage in (Stage.OBJECT, Stage.DISTANCE, Stage.NORMAL):
            compared = ratios(stage, self._ours(stage), value, limit)
            good = self._excused(stage, compared[0], limit, edge, continued=True)
        return self._measure(stage, value, limit, edge, good, compared)

    def _measure(
        self,
        stage: Stage,
        theirs: np.ndarray,
        limit: np.ndarray,
        edge: np.ndarray,
        good: np.ndarray,
        compared: tuple[np.ndarray, np.ndarray] | None,
    ) -> Measurement:
        ours, classes, near = self._ours(stage), self.terms.classes, self.terms.near
        if stage is not Stage.RAY and near.any():
            edge = edge | near
        if stage is Stage.VISIBILITY and ours.shape == theirs.shape:
            # Edges are a matter of each light: where a light is undecided, either of 0 and 1 is right for it.
            either = (classes.light | classes.outline[..., np.newaxis]) & np.isin(ours, (0.0, 1.0))
            theirs = np.where(either, ours, theirs)
            edge = edge | classes.edge(stage)
            good = all_of(ours == theirs)
        return measure(
            stage,
            ours,
            theirs,
            limit,
            edge=edge,
            hit=self.ground.conditioning.hit,
            flagged=classes.flagged,
            excused=good | near,
            window=self.terms.window,
            # A position's error is a share of how far away it is, wherever the world's origin lies.
            size=self.ground.conditioning.distance if stage is Stage.POSITION else None,
            precision=self.candidate.precision,
            finite=self._finite(stage),
            compared=compared,
        )
