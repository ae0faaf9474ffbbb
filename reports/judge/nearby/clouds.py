"""`Cloud`: the oracle's answers to nearby problems at some pixels, with which a renderer's values are compared.

A nearby problem explains a value according to this table. A piece is smooth: one face, one of a cube's six, one of a
sphere's two crossings, seen from its lit or its unlit side. A value between those of two pieces is not explained.

    ray                              never: only the forward limit counts
    object                           one of the problems hits it
    distance, position               it is between the least and the greatest value of the problems that hit one piece
                                     of the renderer's object, or within the limit of a value
    normal                           the same for each component, and it is of unit length
    visibility                       for each light one of the problems that hit the renderer's object agrees
    irradiance, exitance, radiance   on one piece it is a sum over lights, each between its least and its greatest
                                     share; lights whose visibility varies are added wholly or not at all

If only radiance is known, any object that a nearby problem hits may be the renderer's.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Samples
from rayproof.reports.judge.answers import all_of, dot, length

SURFACE = (Stage.DISTANCE, Stage.POSITION, Stage.NORMAL)
LIGHT = (Stage.IRRADIANCE, Stage.EXITANCE, Stage.RADIANCE)
WIDE = 0.01  # a limit above this share of the value is called wide
# The most undecided lights whose combinations are listed; up to twice as many are listed in two halves.
MOST_LISTED = 12
FACES, PIECES = 1 << 21, 1 << 21  # more than a shape has


@dataclass(frozen=True, kw_only=True)
class Cloud:
    """The oracle's answers at pixels (n,), once for each of several problems (K)."""

    rows: Mapping[Stage, np.ndarray]  # (K, n, channels)
    codes: np.ndarray  # (K, n) int: number of the hit shape, face, piece and side; -1 on a miss
    shares: np.ndarray | None  # (K, n, lights, 3): irradiance of each light where it is visible
    factors: Mapping[Stage, np.ndarray]  # (K, n, 3)
    ambient: Mapping[Stage, np.ndarray]  # (K, n, 3)

    def at(self, pixels: np.ndarray) -> "Cloud":
        """Return the answers at some of the pixels."""
        return Cloud(
            rows={stage: image[:, pixels] for stage, image in self.rows.items()},
            codes=self.codes[:, pixels],
            shares=None if self.shares is None else self.shares[:, pixels],
            factors={stage: image[:, pixels] for stage, image in self.factors.items()},
            ambient={stage: image[:, pixels] for stage, image in self.ambient.items()},
        )

    def named(self, objects: np.ndarray | None) -> np.ndarray:
        """Return a mask (K, n) of answers that hit the objects (n, 2) that a renderer names; all True for None."""
        if objects is None:
            return np.ones(self.codes.shape, dtype=bool)
        return all_of(self.rows[Stage.OBJECT] == objects)

    def pieces(self, counting: np.ndarray, wanted: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Yield (pixels (m,), answers (K, m) of a piece at each pixel) until all pieces of all pixels were yielded.

        `counting` (K, n) is the mask of valid answers; `wanted` (n,), which a caller may change between two pieces, is
        the mask of pixels that are still needed.
        """
        left = counting & wanted
        while True:
            left &= wanted
            pixels = np.flatnonzero(left.any(axis=0))
            if not len(pixels):
                return
            first = left[:, pixels].argmax(axis=0)
            answers = left[:, pixels] & (self.codes[:, pixels] == self.codes[first, pixels])
            left[:, pixels] &= ~answers
            yield pixels, answers


def split(samples: Samples, times: int) -> Cloud:
    """Return the answers of one call with `times` points per pixel as a cloud, with one problem per point."""

    def parted(image: np.ndarray) -> np.ndarray:
        return image.reshape(times, -1, *image.shape[1:])

    rows = {stage: parted(image) for stage, image in samples.rows.items()}
    return Cloud(
        rows=rows,
        codes=codes_of(rows, parted(samples.pieces)),
        shares=None if samples.shares is None else parted(samples.shares),
        factors={stage: parted(image) for stage, image in samples.factors.items()},
        ambient={stage: parted(image) for stage, image in samples.ambient.items()},
    )


def joined(clouds: Sequence[Cloud]) -> Cloud:
    """Return several clouds at the same pixels as one."""
    first = clouds[0]
    return Cloud(
        rows={stage: np.concatenate([cloud.rows[stage] for cloud in clouds]) for stage in first.rows},
        codes=np.concatenate([cloud.codes for cloud in clouds]),
        shares=None
        if first.shares is None
        else np.concatenate([cloud.shares for cloud in clouds if cloud.shares is not None]),
        factors={stage: np.concatenate([cloud.factors[stage] for cloud in clouds]) for stage in first.factors},
        ambient={stage: np.concatenate([cloud.ambient[stage] for cloud in clouds]) for stage in first.ambient},
    )


def codes_of(rows: Mapping[Stage, np.ndarray], pieces: np.ndarray) -> np.ndarray:
    """Return a number (...) for the hit shape, face, piece and visible side; -1 on a miss."""
    shape, face = (rows[Stage.OBJECT][..., place].astype(np.int64) for place in range(2))
    lit = np.zeros(shape.shape, dtype=np.int64)
    if Stage.NORMAL in rows:
        lit = (dot(rows[Stage.NORMAL], rows[Stage.RAY]) < 0).astype(np.int64)
    return np.where(shape < 0, -1, 2 * ((shape * FACES + face) * PIECES + pieces) + lit)


@dataclass(frozen=True, kw_only=True)
class Allowed:
    """The allowed difference from a nearby problem's answer at pixels (n,): the problem's forward limits."""

    limits: Mapping[Stage, np.ndarray]  # (n,) or (n, 3), of distance, position and normal
    lights: np.ndarray | None  # (n, lights, 3): of each light's irradiance where it is visible
    relative: np.ndarray | None  # (n, lights): the same for a light straight above, relative to its irradiance
    roundings: float  # relative to a sum of lights: those from irradiance to radiance
    steps: Mapping[Stage, np.ndarray]  # (n,) or (n, channels): of an output that is coarser than its arithmetic

    def at(self, stage: Stage) -> np.ndarray:
        """Return the limit (n, 1) of a stage, which is the normal or an earlier stage."""
        limit = np.asarray(self.limits[stage] + self.steps.get(stage, 0.0))
        return limit[:, np.newaxis]


def is_of_surface(stage: Stage, values: np.ndarray, cloud: Cloud, answers: np.ndarray, allowed: Allowed) -> np.ndarray:
    """Return a mask (n,): values (n, channels) of distance, position or normal are in the range of a piece."""
    samples, limit = cloud.rows[stage], allowed.at(stage)
    here = answers[..., np.newaxis]
    with np.errstate(invalid="ignore"):
        low = np.where(here, samples, np.inf).min(axis=0)
        high = np.where(here, samples, -np.inf).max(axis=0)
        size = 1.0 if stage is Stage.NORMAL else one_of(cloud.rows[Stage.DISTANCE], answers)
        limit = _no_wider(limit, limit > WIDE * np.where(np.isfinite(size), size, 1.0), high - low)
        within = all_of(((values >= low - limit) & (values <= high + limit)) | ((values == low) & (values == high)))
        if stage is Stage.NORMAL:
            # A hit's normal is of unit length to within its own error, and a miss has none.
            within &= np.abs(length(values) - length(one_of(samples, answers))) <= allowed.at(stage)[:, 0]
    return within


def _no_wider(limit: np.ndarray, wide: np.ndarray, span: np.ndarray) -> np.ndarray:
    """Return limits, the wide ones reduced to the span of nearby answers.

    The forward limit of an ill-conditioned problem is meaningless: a ray in a plane hits it anywhere.
    """
    return np.where(wide, np.minimum(limit, np.nan_to_num(span)), limit)


def one_of(samples: np.ndarray, answers: np.ndarray) -> np.ndarray:
    """Return the first answer (n, channels) of each pixel's piece."""
    return samples[answers.argmax(axis=0), np.arange(answers.shape[1])]


def is_of_lights(
    stage: Stage, values: np.ndarray, cloud: Cloud, answers: np.ndarray, allowed: Allowed
) -> tuple[np.ndarray, np.ndarray]:
    """Return masks (n,): values (n, 3) are a possible sum of lights on a piece, or have too many undecided lights.

    The latter are only tested to be within the span of all combinations of lights.
    """
    assert cloud.shares is not None
    assert allowed.lights is not None
    factor, here = cloud.factors[stage], answers[..., np.newaxis]
    with np.errstate(invalid="ignore"):
        shares = np.where(cloud.shares != 0, cloud.shares * factor[:, :, np.newaxis], 0.0)
        slack = np.where(here, np.abs(factor), 0.0).max(axis=0)[:, np.newaxis] * allowed.lights
        counted = answers[..., np.newaxis, np.newaxis]
        low, high = np.where(counted, shares, np.inf).min(axis=0), np.where(counted, shares, -np.inf).max(axis=0)
        if allowed.relative is not None:
            slack = _no_wider(slack, (allowed.relative > WIDE)[..., np.newaxis], high - low)
        low, high = low - slack, high + slack
        base = cloud.ambient[stage]
        least = np.where(here, base, np.inf).min(axis=0)
        greatest = np.where(here, base, -np.inf).max(axis=0)
    visible = cloud.rows[Stage.VISIBILITY] > 0
    lit, dark = (np.any(here & state, axis=0) for state in (visible, ~visible))  # (n, lights)
    tolerance = allowed.roundings * np.abs(values) + allowed.steps.get(stage, np.zeros_like(values))
    good, spanned = np.zeros(len(values), dtype=bool), np.zeros(len(values), dtype=bool)
    for pixel, value in enumerate(values):
        always, free = lit[pixel] & ~dark[pixel], np.flatnonzero(lit[pixel] & dark[pixel])
        below = least[pixel] + low[pixel, always].sum(axis=0) - tolerance[pixel]
        above = greatest[pixel] + high[pixel, always].sum(axis=0) + tolerance[pixel]
        room = value - above, value - below  # the free lights' sums must reach from the first to the second
        good[pixel], spanned[pixel] = _some_choice(low[pixel, free], high[pixel, free], *room)
    return good, spanned


def _some_choice(low: np.ndarray, high: np.ndarray, least: np.ndarray, greatest: np.ndarray) -> tuple[bool, bool]:
    """Return whether a combination of the lights (k, 3) has a sum between `least` (3,) and `greatest`.

    The sum of a combination is between the sums of its `low` and of its `high`. The combinations of more than twice
    `MOST_LISTED` lights are not listed; then the second result is whether the value is within their span.
    """
    count = len(low)
    if count > 2 * MOST_LISTED:
        spans = np.minimum(low, 0).sum(axis=0) <= greatest, np.maximum(high, 0).sum(axis=0) >= least
        return False, bool(np.all(spans))
    half = count // 2 if count > MOST_LISTED else count
    sums = [_sums(low[:half], high[:half]), _sums(low[half:], high[half:])]
    (first_low, first_high), (second_low, second_high) = sums
    for more_low, more_high in zip(second_low, second_high, strict=True):
        reached = (first_low + more_low <= greatest) & (first_high + more_high >= least)
        if reached.all(axis=1).any():
            return True, False
    return False, False


def _sums(low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the sums (2^k, 3) of every choice of lights (k, 3)."""
    choices = (np.arange(1 << len(low))[:, np.newaxis] >> np.arange(len(low))) & 1
    return choices @ low, choices @ high
