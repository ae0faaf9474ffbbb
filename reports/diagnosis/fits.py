"""Fits: mistakes that no list has, found as a law from some of the failing cases and held against the others.

A law is a number, or a power of one variable of the scene, or a sum of powers. It is estimated where the renderer is
wrong; whether it is true, the cases decide that took no part in the estimate.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage, StageImages
from rayproof.reports.diagnosis.trial import Evidence
from rayproof.reports.diagnosis.trial_by_stages import NOTHING, Continued

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
