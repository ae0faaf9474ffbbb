"""Judging box-filtered radiance: the mean over samples x samples points of a pixel, n^2 rays of the same formulas.

The tracer renders the scene at n times the resolution, whose pixel centres are the points, and averages; a reference
does it in its own way (Mitsuba: n^2 stratified unjittered samples through its own film). The limit is the mean of
the fine image's limits plus, for each fine pixel that is an edge, what it is worth if it falls on the other side.
"""

from dataclasses import replace

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage
from rayproof.reports.judge.comparison.check import Check
from rayproof.reports.judge.comparison.measurement import measure
from rayproof.reports.judge.tolerance.pair_limits import Terms
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
    )


def _largest_near(image: np.ndarray) -> np.ndarray:
    """Return each pixel's largest value among it and its eight neighbours."""
    padded = np.pad(image, ((1, 1), (1, 1), (0, 0)), mode="edge")
    height, width = image.shape[:2]
    return np.max([padded[y : y + height, x : x + width] for y in range(3) for x in range(3)], axis=0)
