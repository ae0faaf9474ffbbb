"""Fits of a law (a number, a power, a sum of powers) to some failing cases, held against the others.

A law is a number, or a power of one variable of the scene, or a sum of powers. It is estimated where the renderer is
wrong; the cases that took no part in the estimate decide whether it is true. A hypothesis is held against a few pixels
of a case's radiance (`Samples`) before whole images are.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from rayproof.cases.scene import Scene, SceneError
from rayproof.cases.stages import IMAGE_STAGES, Stage, StageImages
from rayproof.reports.diagnosis import Given, Way
from rayproof.reports.diagnosis.answering import Unanswerable, follows
from rayproof.reports.diagnosis.trials import NOTHING, Continued, Evidence, concerned

FITTED = 12  # failing cases that a law is estimated from
# Relative: float32 and six decimal digits lose 5e-6 of a ratio, and an estimate from several such ratios some times
# as much. What a law says is held to the limits themselves afterwards.
CLOSE = 2e-4
MOST_OUTSIDE = 0.05  # of the samples: pixels beside shadows that no edge announces
LEAST_SAMPLES = 60
EXPONENTS = (1.0, -1.0, 0.5, -0.5, 2.0, -2.0)


@dataclass(frozen=True, kw_only=True)
class Fitting:
    """One failing case that a law is estimated from."""

    evidence: Evidence
    right: StageImages  # with all stages: each as it follows from the renderer's own before it; else the oracle's
    ours: StageImages
    plain: np.ndarray  # (height, width): pixels away from edges

    @property
    def scene(self) -> Scene:
        """Return the scene."""
        return self.evidence.scene

    @property
    def staged(self) -> bool:
        """Say whether the renderer wrote every stage."""
        return Stage.RAY in self.ours and Stage.NORMAL in self.ours


def from_images(failing: Sequence[Evidence]) -> list[Fitting]:
    """Return the cases of a renderer that writes radiance alone."""
    return [
        Fitting(evidence=case, right=case.right.answers, ours=case.ours, plain=~case.right.edge)
        for case in failing[:FITTED]
    ]


def from_stages(failing: Sequence[Continued]) -> list[Fitting]:
    """Return the cases of a renderer that writes every stage."""
    found = []
    for case in failing[:FITTED]:
        follows = {stage: case.value(NOTHING, stage) for stage in case.stages}
        right = {stage: value for stage, value in follows.items() if value is not None}
        if len(right) == len(case.stages):
            found.append(Fitting(evidence=case.evidence, right=right, ours=case.own, plain=~case.evidence.never))
    return found


def rounded(value: float) -> float:
    """Return the number of few digits that an estimate stands for, or the estimate."""
    for digits in (0, 1, 2, 3):
        short = float(f"{value:.{digits}e}")
        if abs(short - value) <= CLOSE * abs(value):
            return short
    return value


def one_value(samples: np.ndarray) -> float | None:
    """Return the number that nearly all samples are, or None."""
    samples = samples[np.isfinite(samples)]
    if len(samples) < LEAST_SAMPLES:
        return None
    value = float(np.median(samples))
    outside = np.count_nonzero(np.abs(samples - value) > 5 * CLOSE * max(1.0, abs(value)))
    return rounded(value) if outside <= MOST_OUTSIDE * len(samples) else None


def sum_of(terms: np.ndarray) -> np.ndarray | None:
    """Return the coefficients with which terms (samples, count) add up to 1 in nearly all samples; 0 where not needed.

    None where there are none, or where a single term would do.
    """
    terms = terms[np.all(np.isfinite(terms), axis=-1)]
    if len(terms) < LEAST_SAMPLES:
        return None
    used = np.ones(terms.shape[1], dtype=bool)
    kept = np.ones(len(terms), dtype=bool)
    coefficients = np.zeros(terms.shape[1])
    for _ in range(3 * terms.shape[1]):
        coefficients = np.zeros(terms.shape[1])
        coefficients[used] = np.linalg.lstsq(terms[kept][:, used], np.ones(np.count_nonzero(kept)), rcond=None)[0]
        off = np.abs(terms @ coefficients - 1)
        near = off <= max(CLOSE, 3 * float(np.median(off)))
        share = np.max(np.abs(terms * coefficients), axis=0)
        needed = used & (share > 5 * CLOSE)
        if np.array_equal(near, kept) and np.array_equal(needed, used):
            break
        if np.count_nonzero(near) < LEAST_SAMPLES or not needed.any():
            return None
        kept, used = near, needed
    off = np.abs(terms @ coefficients - 1)
    if np.count_nonzero(off > CLOSE) > MOST_OUTSIDE * len(off) or np.count_nonzero(coefficients) < 2:
        return None
    short = np.array([rounded(value) for value in coefficients])
    better = np.median(np.abs(terms @ short - 1)) <= 2 * float(np.median(off)) + CLOSE / 10
    return short if better else coefficients


def spelled(terms: Mapping[str, float]) -> str:
    """Return a sum in words: numbers before the names of its terms, an empty name for 1."""
    found = ""
    for name, value in terms.items():
        if value == 0:
            continue
        number = f"{abs(value):.4g}"
        factor = number if not name else name if number == "1" else f"{number} {name}"
        sign = ("-" if value < 0 else "") if not found else (" - " if value < 0 else " + ")
        found += sign + factor
    return found


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
