"""Box-filtered radiance of a case: every candidate before every witness that renders it."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rayproof.cases.case import Case
from rayproof.cases.stages import Stage
from rayproof.reports.judge.comparison.box_filter import box_mean, finer, supersampled_check, under_samples
from rayproof.reports.judge.comparison.check import Check, unmeasured
from rayproof.reports.judge.oracle import FullOracle, stages_of
from rayproof.reports.judge.renderers import Candidate, Witness, abstention
from rayproof.reports.judge.tolerance.pair_limits import Terms
from rayproof.reports.judge.tolerance.scene_context import ground
from rayproof.reports.results.outcomes import Outcome


def mean_checks(
    case: Case, candidates: Sequence[Candidate], witnesses: Sequence[Witness], oracle: FullOracle
) -> tuple[list[Check], list[tuple[Candidate, Witness, Stage]]]:
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
