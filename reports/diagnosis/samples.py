"""A few pixels of a case, in which a hypothesis is held against a renderer's radiance before whole images are."""

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from rayproof.cases.scene import SceneError
from rayproof.cases.stages import IMAGE_STAGES, Stage, StageImages
from rayproof.reports.diagnosis import Given, Way
from rayproof.reports.diagnosis.answering import Unanswerable, follows
from rayproof.reports.diagnosis.trial import Evidence
from rayproof.reports.diagnosis.trial_by_stages import concerned

WRONG, RIGHT = 80, 40  # pixels of a case that are looked at
NEAR = 1e-3  # relative: what is no farther off is the same; limits are asked of what is left
AGREE = 0.97  # of the pixels


@dataclass(frozen=True, kw_only=True)
class Sampled:
    """Some pixels of a case."""

    evidence: Evidence
    _kept: dict = field(default_factory=dict)

    @cached_property
    def places(self) -> np.ndarray:
        """Return which pixels, by number: wrong ones and others, none beside an edge of the right answer."""
        plain = ~np.ravel(self.evidence.right.edge)
        chosen = np.random.default_rng(1)
        wrong = np.ravel(self.evidence.wrong) & plain
        found = []
        for some, most in ((wrong, WRONG), (plain & ~wrong, RIGHT)):
            among = np.flatnonzero(some)
            found.append(chosen.choice(among, min(most, len(among)), replace=False))
        return np.concatenate(found)

    def _taken(self, image: np.ndarray) -> np.ndarray:
        return np.asarray(image, dtype=np.float64).reshape(-1, image.shape[-1])[self.places][np.newaxis]

    @cached_property
    def ours(self) -> np.ndarray:
        """Return the renderer's radiance there, (1, pixels, 3)."""
        return self._taken(self.evidence.ours[Stage.RADIANCE])

    def answers(self, way: Way) -> StageImages | None:
        """Return what a way answers there, (1, pixels, channels); None where it has no answer."""
        key = id(way)
        if key not in self._kept:
            try:
                self._kept[key] = way, self._answers(way)
            except (Unanswerable, SceneError, ValueError, OverflowError):
                self._kept[key] = way, None
        return self._kept[key][1]

    def _answers(self, way: Way) -> StageImages:
        scene = self.evidence.scene if way.asked is None else way.asked(self.evidence.scene)
        oracle = self.evidence.oracle
        rays = self.evidence.right.answers[Stage.RAY]
        if scene.camera != self.evidence.scene.camera:
            rays = oracle.continue_from(scene, Stage.RAY, {})
        if Stage.RAY in way.stages:
            rays = way.stages[Stage.RAY](Given(scene=scene, answers={}, right=rays, parameter=0.0))
        found: StageImages = {Stage.RAY: self._taken(rays)}
        small = replace(scene, camera=replace(scene.camera, width=len(self.places), height=1))
        with np.errstate(all="ignore"):
            for stage in IMAGE_STAGES[1:]:
                formulas = concerned(way.formulas, scene, stage)
                value = follows(replace(way, formulas=formulas), small, stage, found, oracle)
                if stage in way.stages:
                    value = way.stages[stage](Given(scene=small, answers=found, right=value, parameter=0.0))
                found[stage] = value
        return found

    def agrees(self, way: Way) -> bool | None:
        """Say whether the renderer has a way's radiance; None where the way has no answer."""
        answers = self.answers(way)
        if answers is None:
            return None
        value, finite = answers[Stage.RADIANCE], float(np.nanmax(np.abs(self.ours), initial=0.0))
        with np.errstate(all="ignore"):
            near = np.abs(value - self.ours) <= NEAR * np.abs(value) + 1e-6 * finite
        same = np.all(near | np.isnan(value) | (value == self.ours), axis=-1)
        return bool(np.count_nonzero(same) >= AGREE * same.size)
