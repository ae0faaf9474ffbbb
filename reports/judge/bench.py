"""The bench at which one candidate is judged against one witness: limits, classes and sides, computed once."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cases.answers import Answers
from cases.scene import Scene
from cases.stages import Stage
from reports.judge.calibration import calibration
from reports.judge.classes import Classes, classify
from reports.judge.conditioning import Conditioning
from reports.judge.ground import Ground
from reports.judge.limits import Limits, Roundoff, continued_light_limit, continued_position_limit
from reports.judge.measurement import Measurement, measure, ratios
from reports.judge.parties import Candidate, Witness
from reports.judge.sides import Sides, excused, sides, with_twins

GEOMETRY = (Stage.OBJECT, Stage.DISTANCE, Stage.POSITION, Stage.NORMAL)
LIGHT = (Stage.IRRADIANCE, Stage.EXITANCE, Stage.RADIANCE)


@dataclass(frozen=True, kw_only=True)
class Bench:
    """One candidate before one witness, on the ground of the oracle's truth, whoever the witness is."""

    ground: Ground
    candidate: Candidate
    witness: Witness

    @property
    def scene(self) -> Scene:
        """Return the scene judged."""
        return self.ground.scene

    @property
    def truth(self) -> Answers:
        """Return the oracle's answers."""
        return self.ground.truth

    @property
    def conditioning(self) -> Conditioning:
        """Return how much the scene magnifies rounding."""
        return self.ground.conditioning

    @cached_property
    def limits(self) -> Limits:
        """Return the limits: the candidate's rounding plus the witness's."""
        mine, other = (self.ground.limits(g, by_matrices=self.candidate.by_matrices) for g in self._roundoffs)
        return Limits(
            continued={stage: mine.continued[stage] + other.continued[stage] for stage in mine.continued},
            end_to_end={stage: mine.end_to_end[stage] + other.end_to_end[stage] for stage in mine.end_to_end},
            cosine=mine.cosine + other.cosine,
            position=mine.position + other.position,
        )

    @cached_property
    def classes(self) -> Classes:
        """Return the pixel classes for the larger of the two roundoffs and the sum of the two epsilons."""
        return classify(
            self.scene,
            self.truth,
            self.ground.edges,
            self.conditioning,
            self.limits,
            max(self._roundoffs, key=lambda g: g(1)),
            shadow_epsilon=self.candidate.shadow_epsilon + self.witness.shadow_epsilon,
        )

    @property
    def _roundoffs(self) -> tuple[Roundoff, Roundoff]:
        return self._roundoff(self.candidate), self._roundoff(self.witness)

    @staticmethod
    def _roundoff(party: Candidate | Witness) -> Roundoff:
        """Return a party's rounding: derived for the tracer and the oracle, calibrated for other references."""
        known = calibration(party.name)
        return Roundoff(party.precision, scale=known.factor, baked=known.baked_normals)

    @cached_property
    def _sides(self) -> Sides:
        """Return the oracle's answers around every edge pixel."""
        assert self.candidate.answers is not None
        stages = tuple(stage for stage in GEOMETRY if stage in self.candidate.answers and stage in self.truth)
        oracle, classes = self.ground.oracle, self.classes
        around = sides(oracle, self.scene, stages, classes.outline, classes.reach)
        return with_twins(around, oracle, self.scene, self.truth, self.candidate.answers, classes.depth)

    def _excused(
        self, stage: Stage, theirs: np.ndarray, limit: np.ndarray, edge: np.ndarray, *, continued: bool
    ) -> np.ndarray:
        """Return the edge pixels that have a side's value; the oracle is asked only if an edge pixel differs at all."""
        assert self.candidate.answers is not None
        over = ratios(stage, self.candidate.answers[stage], np.asarray(theirs, dtype=np.float64), limit)[0]
        if Stage.OBJECT not in self.candidate.answers or not np.any((over > 1) & edge):
            return np.zeros(edge.shape, dtype=bool)
        return excused(stage, self.candidate.answers, self._sides, limit, edge.shape, continued=continued)

    def end_to_end(self, stage: Stage) -> Measurement:
        """Measure the candidate's stage against the witness's own."""
        assert self.candidate.answers is not None
        shape = self.classes.outline.shape
        limit = self.limits.end_to_end.get(stage, np.zeros(shape))
        edge = self.classes.edge(stage)
        theirs = self.witness.answers[stage]
        if stage in GEOMETRY:
            good = self._excused(stage, theirs, limit, edge, continued=False)
        else:
            good = np.isfinite(self.candidate.answers[stage]).all(axis=-1)
        return self._measure(stage, theirs, limit, edge, good)

    def continued(self, stage: Stage, value: np.ndarray) -> Measurement:
        """Measure the candidate's stage against `value`, which the oracle made from the candidate's own stages."""
        assert self.candidate.answers is not None
        shape = self.classes.outline.shape
        edge = self.classes.outline if stage in (Stage.OBJECT, Stage.DISTANCE, Stage.NORMAL) else np.zeros(shape, bool)
        limit = self.limits.continued.get(stage, np.zeros(shape))
        if stage is Stage.POSITION:
            # By the tracer's own distance: at an outline it may have hit where the oracle's ray misses.
            limit = continued_position_limit(self.scene, self.candidate.answers, self._roundoffs)
        if stage in LIGHT:
            edge = self.classes.flagged
            mine, other = (
                continued_light_limit(self.scene, stage, self.candidate.answers, value, g) for g in self._roundoffs
            )
            limit = mine + other
        good = np.ones(shape, dtype=bool)
        if stage in (Stage.OBJECT, Stage.DISTANCE, Stage.NORMAL):
            good = self._excused(stage, value, limit, edge, continued=True)
        return self._measure(stage, value, limit, edge, good)

    def _measure(
        self, stage: Stage, theirs: np.ndarray, limit: np.ndarray, edge: np.ndarray, good: np.ndarray
    ) -> Measurement:
        assert self.candidate.answers is not None
        ours = self.candidate.answers[stage]
        theirs = np.asarray(theirs, dtype=np.float64)
        if stage is Stage.VISIBILITY and ours.shape == theirs.shape:
            # Edges are a matter of each light: where a light is undecided, either of 0 and 1 is right for it.
            either = (self.classes.light | self.classes.outline[..., np.newaxis]) & np.isin(ours, (0.0, 1.0))
            theirs = np.where(either, ours, theirs)
            edge = self.classes.edge(stage)
            good = np.all(ours == theirs, axis=-1)
        return measure(
            stage,
            ours,
            theirs,
            limit,
            edge=edge,
            hit=self.conditioning.hit,
            flagged=self.classes.flagged,
            excused=good,
            precision=self.candidate.precision,
        )
