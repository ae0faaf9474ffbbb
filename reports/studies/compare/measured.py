"""One contender at one stage of one scene: which pixels are decided wrongly, and how far off the others are."""

from dataclasses import dataclass

import numpy as np

from rayproof.cases.rounding import UNIT_ROUNDOFF
from rayproof.cases.stages import Stage, StageImages
from rayproof.reports.judge.measurement import DIRECTIONS, error
from rayproof.reports.studies.compare.truths import Truth

LEAST = 0.125  # roundoffs: what an exact result counts as, so that its logarithm exists
LEAST_SIZE = 2.0**-900  # what 0 counts as where a roundoff is relative to it, far below every unit in use
UNITS: dict[Stage, str] = {
    Stage.RAY: "degrees",
    Stage.OBJECT: "m",
    Stage.DISTANCE: "m",
    Stage.POSITION: "m",
    Stage.NORMAL: "degrees",
    Stage.VISIBILITY: "",
    Stage.IRRADIANCE: "W/m^2",
    Stage.EXITANCE: "W/m^2",
    Stage.RADIANCE: "W/(m^2 sr)",
}


@dataclass(frozen=True, kw_only=True)
class Measured:
    """All pixels (height, width) of one contender at one stage."""

    counts: np.ndarray  # bool: the stage has a value here, by the truth or by the contender
    wrong: np.ndarray  # bool: false hit, false miss, wrong object, wrong visibility, NaN or infinity
    scaled: np.ndarray  # error / (K u |X|), u the contender's own unit roundoff; NaN where wrong or without a value
    natural: np.ndarray  # error in `UNITS`, likewise
    floored: np.ndarray  # the same, at least what an exact result counts as
    unit_roundoff: float


def measured(
    truth: Truth, stage: Stage, answers: StageImages, *, precision: str, shapes: frozenset[int] | None
) -> Measured:
    """Measure a contender's stage against the truth made from its own earlier stages.

    Of `shapes`, by index, are the pixels that count: those that show one of them by the truth or by the contender;
    None stands for all pixels.
    """
    ours = answers[Stage.DISTANCE if stage is Stage.OBJECT else stage]
    off = error(Stage.DISTANCE if stage is Stage.OBJECT else stage, ours, truth.value)
    per_pixel = off if off.ndim == 2 else off.max(axis=-1, initial=0.0)
    wrong = np.any(ours != truth.value, axis=-1) if stage is Stage.VISIBILITY else ~np.isfinite(per_pixel)
    counts = truth.counts
    if truth.objects is not None:
        found = answers[Stage.OBJECT]
        wrong |= np.any(found != truth.objects, axis=-1)
        counts = counts | (found[..., 0] >= 0)
        concerned = [found, truth.objects]
    else:
        concerned = [answers[Stage.OBJECT]] if Stage.OBJECT in answers else []
    if shapes is not None:
        counts = counts & np.any([np.isin(one[..., 0], list(shapes)) for one in concerned], axis=0)
    u = UNIT_ROUNDOFF[precision]
    with np.errstate(divide="ignore", invalid="ignore"):
        magnified = truth.magnified if off.ndim == truth.magnified.ndim else truth.magnified[..., np.newaxis]
        # A channel without light has no error and no scale.
        scaled = np.where(off == 0, 0.0, off / magnified / u)
    if scaled.ndim == 3:
        scaled = scaled.max(axis=-1, initial=0.0)
    good = counts & truth.counts & ~wrong & np.isfinite(scaled)
    if stage is Stage.VISIBILITY:
        good = np.zeros_like(good)  # right or wrong; there is no error to be small
    unit = np.degrees(1.0) if stage in DIRECTIONS else 1.0
    return Measured(
        counts=counts,
        wrong=wrong & counts,
        scaled=np.where(good, scaled, np.nan),
        natural=np.where(good, per_pixel * unit, np.nan),
        floored=np.where(good, np.maximum(per_pixel, LEAST * u * _size(stage, truth.value)) * unit, np.nan),
        unit_roundoff=u,
    )


def _size(stage: Stage, value: np.ndarray) -> np.ndarray:
    """Return |X| (height, width): 1 for directions, the largest channel for light; never 0."""
    if stage in DIRECTIONS:
        return np.ones(value.shape[:2])
    return np.maximum(np.abs(value).max(axis=-1, initial=0.0), LEAST_SIZE)
