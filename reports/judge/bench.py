"""The bench at which one candidate is judged against one witness: limits, classes and sides, computed once."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cases.answers import Answers
from cases.scene import Scene
from cases.stages import Stage, upto
from reports.judge.calibration import calibration
from reports.judge.channels import all_of, largest, length
from reports.judge.classes import Classes
from reports.judge.conditioning import Conditioning
from reports.judge.ground import Ground
from reports.judge.limits import Limits, Roundoff, continued_light_limit, continued_position_limit
from reports.judge.measurement import Measurement, measure, ratios
from reports.judge.parties import Candidate, Witness
from reports.judge.resolving import Coarseness
from reports.judge.sides import Sides, excused, excused_anyhow, sides, with_twins

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
        """Return the limits: the candidate's rounding and output steps plus the witness's."""
        rounding = self.ground.together(*self._roundoffs, by_matrices=self._by_matrices)
        if not self._coarse:
            return rounding
        return self.ground.once(("coarse", self.rounding), (), lambda: self._coarsened(rounding))

    def _coarsened(self, rounding: Limits) -> Limits:
        """Return limits with the parties' output steps added."""
        truth, whole = self.truth, dict(rounding.end_to_end)
        for stage in whole:
            whole[stage] = whole[stage] + sum(one.step(stage, truth[stage]) for one in self._coarseness)
        # The oracle continues from what the candidate's output kept of its positions and normals.
        moved, turned = (self._coarseness[0].step(stage, truth[stage]) for stage in (Stage.POSITION, Stage.NORMAL))
        cosine = rounding.cosine.copy()
        for index, light in enumerate(self.scene.lights):
            r = length(np.asarray(light.position) - truth[Stage.POSITION])
            cosine[..., index] += np.divide(moved, r, out=np.zeros_like(r), where=r > 0) + turned
        return replace(rounding, end_to_end=whole, cosine=cosine, position=rounding.position + moved)

    @cached_property
    def classes(self) -> Classes:
        """Return the pixel classes for the larger of the two roundoffs and the sum of the two epsilons."""
        return self._classes(self.candidate.shadow_epsilon + self.witness.shadow_epsilon)

    @cached_property
    def window(self) -> np.ndarray:
        """Return the pixels (height, width) that only the parties' own epsilons leave undecided."""
        unlit = np.zeros_like(self.classes.outline)
        epsilon = self.candidate.shadow_epsilon + self.witness.shadow_epsilon
        if self.scene.lights and np.any(epsilon > 0):
            unlit = self.classes.undecided & ~self._classes(0.0).undecided
        return self._near | (unlit & ~self.classes.outline)

    @cached_property
    def _near(self) -> np.ndarray:
        """Return the pixels whose hit lies nearer to the eye than a party sees."""
        nearest = self.candidate.ray_epsilon + self.witness.ray_epsilon
        if not nearest:
            return np.zeros(self.conditioning.hit.shape, dtype=bool)
        return self.conditioning.hit & (self.conditioning.distance <= nearest + self._largest(Stage.DISTANCE))

    def _largest(self, stage: Stage) -> np.ndarray:
        limit = self.limits.end_to_end[stage]
        return largest(limit) if limit.ndim == 3 else limit

    def _classes(self, shadow_epsilon: float | np.ndarray) -> Classes:
        """Return the classes for one epsilon; kept on the ground, since many parties round and step alike."""
        g = max(self._roundoffs, key=lambda each: each(1))
        return self.ground.classes(self.limits, g, shadow_epsilon, key=self.rounding)

    @cached_property
    def _coarseness(self) -> tuple[Coarseness, Coarseness]:
        return Coarseness(resolutions=self.candidate.resolutions), Coarseness(resolutions=self.witness.resolutions)

    @property
    def _by_matrices(self) -> bool:
        return self.candidate.by_matrices or self.witness.by_matrices

    @property
    def _coarse(self) -> bool:
        return bool(self.candidate.resolutions or self.witness.resolutions)

    def because(self, stage: Stage) -> str:
        """Return what the parties' outputs add to a stage's limit, in words that follow its derivation, or nothing."""
        names = (self.candidate.name, self.witness.name)
        return "".join(one.because(stage, name) for one, name in zip(self._coarseness, names, strict=True))

    @cached_property
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
        asked = {Stage.OBJECT, *self.candidate.answers}
        stages = tuple(stage for stage in GEOMETRY if stage in asked and stage in self.truth)
        oracle, classes = self.ground.oracle, self.classes
        around = self.ground.once(
            ("sides", stages),
            (classes.outline, classes.reach),
            lambda: sides(oracle, self.scene, stages, classes.outline, classes.reach),
        )
        if Stage.OBJECT not in self.candidate.answers:
            return around
        return with_twins(around, oracle, self.scene, self.truth, self.candidate.answers, classes.depth)

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
            ("end to end", stage, self._rules), (ours[stage], theirs, *seen), lambda: self._end_to_end(stage)
        )

    @cached_property
    def rounding(self) -> tuple:
        """Return what the limits of this bench depend on beside the ground."""
        steps = tuple(tuple(party.resolutions.items()) for party in (self.candidate, self.witness))
        return tuple(each.key for each in self._roundoffs), self._by_matrices, steps

    @cached_property
    def _rules(self) -> tuple:
        """Return what the limits and classes of this bench depend on beside the ground."""
        epsilon = np.asarray(self.candidate.shadow_epsilon + self.witness.shadow_epsilon, dtype=np.float64)
        near = self.candidate.ray_epsilon, self.witness.ray_epsilon
        return self.rounding, epsilon.tobytes(), near, self.candidate.chained

    def _end_to_end(self, stage: Stage) -> Measurement:
        assert self.candidate.answers is not None
        shape = self.classes.outline.shape
        limit = self.limits.end_to_end.get(stage, np.zeros(shape))
        edge = self.classes.edge(stage)
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
        assert self.candidate.answers is not None
        limit = self.limits.end_to_end.get(stage, np.zeros(self.classes.outline.shape))
        theirs = np.asarray(self.witness.answers[stage], dtype=np.float64)
        ratio = ratios(stage, self.candidate.answers[stage], theirs, limit)[0]
        return np.where(self.classes.edge(stage) | self._near, 0.0, ratio)

    def continued(self, stage: Stage, value: np.ndarray) -> Measurement:
        """Measure the candidate's stage against `value`, which the oracle made from the candidate's own stages."""
        assert self.candidate.answers is not None
        ours = tuple(self.candidate.answers.get(one) for one in upto(stage) if one is not Stage.CAMERA)
        return self.ground.once(
            ("continued", stage, self._rules), (value, *ours), lambda: self._continued(stage, value)
        )

    def _continued(self, stage: Stage, value: np.ndarray) -> Measurement:
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
        if self._coarse:
            mine, other = self._coarseness
            limit = limit + mine.step(stage, value) + other.step(stage, value)
            limit = limit + mine.handed_down(self.scene, stage, self.candidate.answers, self.conditioning)
        if not self.candidate.chained and stage in self.limits.end_to_end:
            # Stages by passes of their own: each is off by its own end-to-end error, and by as much what it is
            # continued from; at an edge the passes need not agree on the side.
            own = self.ground.limits(self._roundoffs[0], by_matrices=self.candidate.by_matrices)
            limit, edge = limit + 2 * own.end_to_end[stage], edge | self.classes.edge(stage)
        good, value, compared = np.ones(shape, dtype=bool), np.asarray(value, dtype=np.float64), None
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
        assert self.candidate.answers is not None
        ours = self.candidate.answers[stage]
        if stage is not Stage.RAY and self._near.any():
            edge = edge | self._near
        if stage is Stage.VISIBILITY and ours.shape == theirs.shape:
            # Edges are a matter of each light: where a light is undecided, either of 0 and 1 is right for it.
            either = (self.classes.light | self.classes.outline[..., np.newaxis]) & np.isin(ours, (0.0, 1.0))
            theirs = np.where(either, ours, theirs)
            edge = edge | self.classes.edge(stage)
            good = all_of(ours == theirs)
        return measure(
            stage,
            ours,
            theirs,
            limit,
            edge=edge,
            hit=self.conditioning.hit,
            flagged=self.classes.flagged,
            excused=good | self._near,
            window=self.window,
            precision=self.candidate.precision,
            finite=self._finite(stage),
            compared=compared,
        )
