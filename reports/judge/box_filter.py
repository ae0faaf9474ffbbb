"""Judging box-filtered radiance: the mean over samples x samples points of a pixel, n^2 rays of the same formulas.

The tracer renders the scene at n times the resolution, whose pixel centres are the points, and averages; a reference
does it in its own way (Mitsuba: n^2 stratified unjittered samples through its own film). The limit is the mean of
the fine image's limits plus, for each fine pixel that is an edge, what it is worth if it falls on the other side.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rayproof.cases.case import Case
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage
from rayproof.reports.judge.answers import Answers, abstention
from rayproof.reports.judge.checks import Check, unmeasured
from rayproof.reports.judge.measurement import Kind, cells_of, measure
from rayproof.reports.judge.oracle import FullOracle, stages_of
from rayproof.reports.judge.scene_truth import Terms, ground
from rayproof.reports.results.outcomes import Outcome

MANY = " x"  # between a configuration and its number of samples a pixel
BECAUSE = "the mean of the fine image's limits, plus the share of fine pixels that are edges times the radiance there"


def finer(scene: Scene, samples: int) -> Scene:
    """Return the scene with `samples` times as many pixels a side: their centres are the sample points."""
    camera = scene.camera
    return replace(scene, camera=replace(camera, width=camera.width * samples, height=camera.height * samples))


def box_mean(image: np.ndarray, samples: int) -> np.ndarray:
    """Return the mean over blocks of samples x samples pixels; shape (height / n, width / n, channels)."""
    height, width = image.shape[0] // samples, image.shape[1] // samples
    return image.reshape(height, samples, width, samples, -1).mean(axis=(1, 3))


def under_samples(configuration: str, samples: int) -> str:
    """Return the name under which a configuration's mean images are judged."""
    return f"{configuration}{MANY}{samples**2}"


def configuration_of(name: str) -> str:
    """Return the configuration whose images, or mean images, are judged under a name."""
    return name.split(MANY)[0]


def supersampled_check(fine: Terms, ours: np.ndarray, theirs: np.ndarray, samples: int) -> Check:
    """Judge one mean image against another; `fine` are the terms of the two at the fine resolution."""
    truth = fine.truth[Stage.RADIANCE]
    edge = fine.classes.edge(Stage.RADIANCE)
    limit = np.where(edge[..., np.newaxis], _largest_near(truth), fine.limits.end_to_end[Stage.RADIANCE])
    # Averaging n^2 numbers of one sign rounds log2(n^2) times at least and n^2 - 1 times at worst.
    rounding = samples**2 * 2.0**-24 * box_mean(truth, samples)
    bound = box_mean(limit, samples) + rounding
    nothing = np.zeros(ours.shape[:2], dtype=bool)
    measured = measure(
        Stage.RADIANCE,
        ours,
        theirs,
        bound,
        edge=nothing,
        hit=box_mean(fine.conditioning.hit[..., np.newaxis].astype(np.float64), samples)[..., 0] > 0,
        flagged=nothing,
        excused=nothing,
        precision=fine.candidate.precision,
    )
    good = measured.worst_ratio <= 1
    why = f"pixel {measured.pixel} is off by {measured.worst_error:.3g}, limit {measured.limit:.3g}"
    return Check(
        configuration=under_samples(fine.candidate.name, samples),
        reference=fine.witness.name,
        stage=Stage.RADIANCE,
        outcome=Outcome.PASS if good else Outcome.FAIL,
        reason="" if good else why,
        why=BECAUSE,
        end_to_end=measured,
        ratio=measured.worst_ratio,
        examined=measured.examined,
        cells=None if good else cells_of(measured.kinds == Kind.WRONG),
    )


def _largest_near(image: np.ndarray) -> np.ndarray:
    """Return each pixel's largest value among it and its eight neighbours."""
    padded = np.pad(image, ((1, 1), (1, 1), (0, 0)), mode="edge")
    height, width = image.shape[:2]
    return np.max([padded[y : y + height, x : x + width] for y in range(3) for x in range(3)], axis=0)


# Box-filtered radiance of a case: every candidate before every witness that renders it.


def mean_checks(
    case: Case, candidates: Sequence[Answers], witnesses: Sequence[Answers], oracle: FullOracle
) -> tuple[list[Check], list[tuple[Answers, Answers, Stage]]]:
    """Judge box-filtered radiance, every candidate before every witness that renders it; return checks and plan."""
    scene = finer(case.scene, case.samples)
    planned = [
        (c, w, Stage.RADIANCE)
        for c in candidates
        if Stage.RADIANCE not in c.unsupported
        for w in witnesses
        if w.answers_at(Stage.RADIANCE)
    ]
    base = ground(scene, stages_of(scene), oracle, known={})
    checks = []
    size = (case.scene.camera.height, case.scene.camera.width, 3)
    for candidate, witness, stage in planned:
        # Under a name of its own: it says nothing of the radiance through the pixels' centres.
        many = replace(candidate, name=under_samples(candidate.name, case.samples))
        if (candidate.fine is None and candidate.mean is None) or witness.mean is None:
            why = candidate.error or witness.error or "no box-filtered image was given"
            how = Outcome.ERROR if candidate.error or not witness.error else abstention(witness)
            checks.append(unmeasured(many, witness, stage, how, why, stopped=candidate.stopped or witness.stopped))
            continue
        fine = Terms(
            ground=base,
            candidate=replace(
                candidate,
                answers=candidate.fine,
                shadow_epsilon=_finer(candidate.shadow_epsilon, case.samples),
            ),
            witness=replace(witness, shadow_epsilon=_finer(witness.shadow_epsilon, case.samples)),
        )
        if candidate.mean is not None:
            ours = candidate.mean
        else:
            assert candidate.fine is not None
            ours = box_mean(candidate.fine[Stage.RADIANCE], case.samples)
        if np.shape(ours) != size:
            why = f"the mean has shape {np.shape(ours)}, not {size}"
            checks.append(unmeasured(many, witness, stage, Outcome.FAIL, why))
            continue
        if np.shape(witness.mean) != size:
            why = f"{witness.name}'s mean has shape {np.shape(witness.mean)}, not {size}: it is no witness"
            checks.append(unmeasured(many, witness, stage, Outcome.REFERENCE_SUSPECT, why))
            continue
        checks.append(supersampled_check(fine, ours, witness.mean, case.samples))
    return checks, planned


def _finer(epsilon: float | np.ndarray, samples: int) -> float | np.ndarray:
    """Return an epsilon at the resolution of the samples: a pixel's holds for all of its samples."""
    return np.kron(epsilon, np.ones((samples, samples))) if np.ndim(epsilon) else epsilon
