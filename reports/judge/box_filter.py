"""The judgement on box-filtered radiance: the mean over samples x samples points of a pixel.

It is compared with the oracle's finer image. The tracer renders the scene at n times the resolution, whose pixel
centres are the points, and averages; a reference does it in its own way (Mitsuba: n^2 stratified unjittered samples
through its own film). The limit is the mean of the fine image's limits plus, for each sample that shows another surface
or other lights in a nearby problem, the largest difference of nearby problems' answers from its own.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rayproof.cases.case import Case
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Analytic
from rayproof.reports.judge.against_oracle import AgainstOracle
from rayproof.reports.judge.answers import Answers, abstention
from rayproof.reports.judge.checks import unmeasured
from rayproof.reports.judge.forward.limits import calibration
from rayproof.reports.judge.measurement import Kind, cells_of, counted, held_to, kinds_of, measure, ratios
from rayproof.reports.judge.oracle import stages_of
from rayproof.reports.judge.pairs import RendererPair
from rayproof.reports.judge.scene_truth import SceneTruth, scene_truth
from rayproof.reports.results.case_records import Check
from rayproof.reports.results.outcomes import Outcome

MANY = " x"  # between a configuration and its number of samples per pixel
BECAUSE = "the mean of the fine image's limits, and of how far nearby problems' answers lie from each sample"


def finer(scene: Scene, samples: int) -> Scene:
    """Return the scene with `samples` times as many pixels per side, whose centres are the sample points."""
    camera = scene.camera
    return replace(scene, camera=replace(camera, width=camera.width * samples, height=camera.height * samples))


def box_mean(image: np.ndarray, samples: int) -> np.ndarray:
    """Return the mean over blocks of samples x samples pixels; shape (height / n, width / n, channels)."""
    height, width = image.shape[0] // samples, image.shape[1] // samples
    return image.reshape(height, samples, width, samples, -1).mean(axis=(1, 3))


def under_samples(configuration: str, samples: int) -> str:
    """Return the name under which a configuration's mean images are judged."""
    return f"{configuration}{MANY}{samples**2}"


def supersampled_check(fine: RendererPair, mean: np.ndarray, expected: np.ndarray, samples: int) -> Check:
    """Judge one mean image against another; `fine` are the two renderers at the fine resolution."""
    truth = fine.base.truth[Stage.RADIANCE]
    limits = [against.own_limits.end_to_end[Stage.RADIANCE] for against in (fine.one, fine.other)]
    off = np.maximum(fine.one.reach_of_radiance, fine.other.reach_of_radiance)
    # Averaging n^2 numbers of the same sign has log2(n^2) roundings at best and n^2 - 1 at worst.
    rounding = samples**2 * 2.0**-24 * box_mean(truth, samples)
    bound = box_mean(limits[0] + limits[1] + off, samples) + rounding
    compared = ratios(Stage.RADIANCE, mean, expected, bound)
    measured = measure(
        Stage.RADIANCE,
        mean,
        expected,
        bound,
        kinds_of(compared[0], *held_to(Stage.RADIANCE, bound, expected)),
        hit=box_mean(fine.base.conditioning.hit[..., np.newaxis].astype(np.float64), samples)[..., 0] > 0,
        precision=fine.subject.precision,
        compared=compared,
    )
    good = measured.worst_ratio <= 1
    why = f"pixel {measured.pixel} is off by {measured.worst_error:.3g}, limit {measured.limit:.3g}"
    return Check(
        configuration=under_samples(fine.subject.name, samples),
        reference=fine.reference.name,
        stage=Stage.RADIANCE,
        outcome=Outcome.PASS if good else Outcome.FAIL,
        reason="" if good else why,
        because=f"{BECAUSE}; {fine.reference.name}: {calibration(fine.reference.name).origin}",
        end_to_end=measured,
        ratio=measured.worst_ratio,
        examined=counted(measured.kinds),
        cells=None if good else cells_of(measured.kinds == Kind.WRONG),
    )


# Box-filtered radiance of a case: every subject against every reference that renders it.


def mean_checks(
    case: Case, subjects: Sequence[Answers], references: Sequence[Answers], oracle: Analytic
) -> tuple[list[Check], list[tuple[Answers, Answers, Stage]]]:
    """Judge box-filtered radiance, every subject against every reference that renders it; return checks and plan."""
    scene = finer(case.scene, case.samples)
    planned = [
        (subject, reference, Stage.RADIANCE)
        for subject in subjects
        if Stage.RADIANCE not in subject.unsupported
        for reference in references
        if reference.answers_at(Stage.RADIANCE)
    ]
    base = scene_truth(scene, stages_of(scene), oracle, known={})
    checks = []
    size = (case.scene.camera.height, case.scene.camera.width, 3)
    for subject, reference, stage in planned:
        # Under a separate name, because it does not test the radiance at the pixels' centres.
        many = replace(subject, name=under_samples(subject.name, case.samples))
        if (subject.fine is None and subject.mean is None) or reference.mean is None:
            why = subject.error or reference.error or "no box-filtered image was given"
            how = Outcome.ERROR if subject.error or not reference.error else abstention(reference)
            checks.append(unmeasured(many, reference, stage, how, why, stopped=subject.stopped or reference.stopped))
            continue
        fine = RendererPair(_fine(base, subject, case.samples), _fine(base, reference, case.samples))
        if subject.mean is not None:
            mean = subject.mean
        else:
            assert subject.fine is not None
            mean = box_mean(subject.fine[Stage.RADIANCE], case.samples)
        if np.shape(mean) != size:
            why = f"the mean has shape {np.shape(mean)}, not {size}"
            checks.append(unmeasured(many, reference, stage, Outcome.FAIL, why))
            continue
        if np.shape(reference.mean) != size:
            why = f"{reference.name}'s mean has shape {np.shape(reference.mean)}, not {size}: it is no witness"
            checks.append(unmeasured(many, reference, stage, Outcome.REFERENCE_SUSPECT, why))
            continue
        checks.append(supersampled_check(fine, mean, reference.mean, case.samples))
    return checks, planned


def _fine(base: SceneTruth, renderer: Answers, samples: int) -> AgainstOracle:
    """Return a renderer at the resolution of the samples: a pixel's shadow epsilon applies to all of its samples."""
    epsilon = renderer.shadow_epsilon
    if np.ndim(epsilon):
        epsilon = np.kron(epsilon, np.ones((samples, samples)))
    return AgainstOracle(base, replace(renderer, answers=renderer.fine or {}, shadow_epsilon=epsilon))
