"""What light may be at an edge: of some object seen there, each undecided light's whole contribution or nothing of it.

A light's unshadowed contribution is Phi cos / (4 pi r^2), or Phi cos under simplified shading, times the albedo for the
exitance and over pi for the radiance (RAD-1 to RAD-4). Over the edge's reach it has a range; which lights are counted
is a choice, and all three channels must be given by the same one. So no value passes because it lies near an edge.
"""

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage
from rayproof.reports.judge.tolerance.channels import all_of, dot, length

# Undecided lights of which every choice is tried at once, 2^8 sums, and by two halves that meet, 2 times 2^11 sums. Of
# more, and where the choices say next to nothing, the interval from none of them to all is taken.
MOST_LISTED, MOST_MET = 8, 22
TELLING = (
    0.01  # of what the choices span, as volume of the three channels, so much at most may have some choice's value
)
AT_ONCE = 512  # pixels: what bounds the memory that their samples take


@dataclass(frozen=True, kw_only=True)
class Seen:
    """What the oracle sees at some pixels, at one or more points around each: (pixels, samples, channels)."""

    rays: np.ndarray
    objects: np.ndarray
    positions: np.ndarray  # m
    normals: np.ndarray


@dataclass(frozen=True, kw_only=True)
class Lights:
    """What is known of each light at some pixels (pixels, lights), and of the rounding there."""

    decided: np.ndarray  # counted in every choice
    free: np.ndarray  # counted or not
    close: np.ndarray  # so near to the point that rounding decides how much arrives
    relative: np.ndarray  # error of cos / r^2, of a light straight above
    rounding: float  # relative error of what follows from irradiance
    step: np.ndarray  # (pixels, 3): how coarse the outputs are

    def of(self, rows: np.ndarray) -> "Lights":
        """Return the same of some of the pixels."""
        return Lights(
            decided=self.decided[rows],
            free=self.free[rows],
            close=self.close[rows],
            relative=self.relative[rows],
            rounding=self.rounding,
            step=self.step[rows],
        )


@dataclass(frozen=True, kw_only=True)
class Held:
    """Which of some pixels have the value of a side, and which of those only lie within an interval."""

    good: np.ndarray
    interval: np.ndarray


def held(scene: Scene, stage: Stage, values: np.ndarray, seen: Seen, lights: Lights) -> Held:
    """Say of values (pixels, 3) of a stage of light whether some object and some choice of lights gives them."""
    exactly, within = np.zeros(len(values), dtype=bool), np.zeros(len(values), dtype=bool)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        straight, cosine, facing = _arriving(scene, stage, seen)
        for rows, same in _objects(seen.objects):
            ranges = _ranges(straight[rows], cosine[rows], same, lights.of(rows))
            value, known = values[rows], lights.of(rows)
            listed = _listed(value, ranges, known) | _met(value, ranges, known)
            between = _between(value, ranges, known)
            counted = known.free | known.decided
            many = np.count_nonzero(known.free, axis=1) > MOST_LISTED
            unbounded = many | (known.close & counted).any(axis=1) | _grazing(facing[rows], same)
            exactly[rows] |= listed & ~(known.close & counted).any(axis=1)
            within[rows] |= between & unbounded
    return Held(good=exactly | within, interval=within & ~exactly)


def _arriving(scene: Scene, stage: Stage, seen: Seen) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return what each light would give from straight above (pixels, samples, lights, 3), its cosine, and n.d."""
    index = seen.objects[..., 0].astype(int)
    known = (index >= 0) & (index < len(scene.shapes))
    albedo = np.array([*(shape.albedo for shape in scene.shapes), (0.0, 0.0, 0.0)], dtype=np.float64)
    factor = np.where(known[..., np.newaxis], albedo[np.where(known, index, -1)], 0.0)
    facing = dot(seen.normals, seen.rays)
    if stage is Stage.IRRADIANCE:
        factor = np.where(known[..., np.newaxis], 1.0, 0.0)
    elif stage is Stage.RADIANCE:
        factor = np.where(facing[..., np.newaxis] < 0, factor, 0.0)
        factor = factor if scene.shading == "simplified" else factor / math.pi
    straight, cosine = [], []
    for light in scene.lights:
        toward = np.asarray(light.position, dtype=np.float64) - seen.positions
        r = length(toward)
        flux = np.asarray(light.flux, dtype=np.float64) * factor
        straight.append(flux if scene.shading == "simplified" else flux / (4 * math.pi * r[..., np.newaxis] ** 2))
        cosine.append(np.clip(dot(seen.normals, toward) / r, 0.0, 1.0))
    return np.stack(straight, axis=-2), np.stack(cosine, axis=-1), facing


def _objects(objects: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield pixels (n,) and which of their samples (n, samples) see one object, until each pixel had all of its."""
    left = np.ones(objects.shape[:2], dtype=bool)
    while left.any():
        every = np.flatnonzero(left.any(axis=1))
        for start in range(0, len(every), AT_ONCE):
            rows = every[start : start + AT_ONCE]
            first = left[rows].argmax(axis=1)
            same = all_of(objects[rows] == objects[rows, first][:, np.newaxis])
            left[rows] &= ~same
            yield rows, same


@dataclass(frozen=True, kw_only=True)
class _Ranges:
    """What each light may add (pixels, lights, 3): over what is seen of one object, and at the very most."""

    low: np.ndarray
    high: np.ndarray
    most: np.ndarray


def _ranges(straight: np.ndarray, cosine: np.ndarray, same: np.ndarray, lights: Lights) -> _Ranges:
    """Return the ranges over the samples (pixels, samples) that see the `same` object."""
    mask = same[..., np.newaxis, np.newaxis]
    each = straight * cosine[..., np.newaxis]
    low, high = np.where(mask, each, np.inf).min(axis=1), np.where(mask, each, -np.inf).max(axis=1)
    most = np.where(mask, straight, -np.inf).max(axis=1)
    # A centre that lies on the edge itself lies just outside the samples of one side: by no more than they span.
    span = high - low
    error = most * lights.relative[..., np.newaxis] + lights.rounding * most
    close = lights.close[..., np.newaxis]
    return _Ranges(
        low=np.where(close, 0.0, np.maximum(low - span, 0.0) - error),
        high=np.where(close, np.inf, high + span + error),
        most=np.where(close, np.inf, most + error),
    )


def _listed(values: np.ndarray, ranges: _Ranges, lights: Lights) -> np.ndarray:
    """Return which values (pixels, 3) one choice among few undecided lights gives (pixels,)."""
    free = lights.free
    # The free lights first; of the others nothing is chosen.
    order = np.argsort(~free, axis=1, kind="stable")[:, :MOST_LISTED]
    may = np.take_along_axis(free, order, axis=1)
    base_low, base_high = (_sum(part, lights.decided) for part in (ranges.low, ranges.high))
    low, high = (np.take_along_axis(part, order[..., np.newaxis], axis=1) for part in (ranges.low, ranges.high))
    good = np.zeros(len(values), dtype=bool)
    for choice in itertools.product((False, True), repeat=order.shape[1]):
        chosen = np.broadcast_to(np.array(choice, dtype=bool), may.shape)
        valid = ~(chosen & ~may).any(axis=1)
        if not valid.any():
            continue
        least, greatest = base_low + _sum(low, chosen), base_high + _sum(high, chosen)
        good |= valid & all_of((values >= least - lights.step) & (values <= greatest + lights.step))
    return good & (np.count_nonzero(free, axis=1) <= MOST_LISTED)


def _met(values: np.ndarray, ranges: _Ranges, lights: Lights) -> np.ndarray:
    """Return which values (pixels, 3) one choice among many undecided lights gives (pixels,).

    Every choice is one among half of the lights and one among the others: that the two meet at the value is looked up
    in sums that are sorted (Horowitz and Sahni, 1974).
    """
    counts, good = np.count_nonzero(lights.free, axis=1), np.zeros(len(values), dtype=bool)
    base_low, base_high = (_sum(part, lights.decided) for part in (ranges.low, ranges.high))
    for pixel in np.flatnonzero((counts > MOST_LISTED) & (counts <= MOST_MET)):
        low, high = ranges.low[pixel, lights.free[pixel]], ranges.high[pixel, lights.free[pixel]]
        if not np.isfinite(high).all():
            continue
        least = values[pixel] - lights.step[pixel] - base_high[pixel]  # what the highest sum must come to
        most = values[pixel] + lights.step[pixel] - base_low[pixel]  # and the lowest one
        width = (most - least) + (high - low).sum(axis=0)
        span = np.maximum(high.sum(axis=0), width)
        if 2.0 ** counts[pixel] * np.prod(np.divide(width, span, out=np.ones(3), where=span > 0)) <= TELLING:
            good[pixel] = _meets(low, high, least, most)
    return good


def _meets(low: np.ndarray, high: np.ndarray, least: np.ndarray, most: np.ndarray) -> bool:
    """Return whether some choice of parts (lights, 3) has a lowest sum up to `most`, and a highest from `least` on."""
    half = len(low) // 2
    one_low, one_high, other_low, other_high = (
        _choices(len(part)) @ part for part in (low[:half], high[:half], low[half:], high[half:])
    )
    order = np.argsort(other_low[:, 0])
    other_low, other_high = other_low[order], other_high[order]
    widest = float((other_high - other_low)[:, 0].max())
    first = np.searchsorted(other_low[:, 0], least[0] - one_high[:, 0] - widest)
    last = np.searchsorted(other_low[:, 0], most[0] - one_low[:, 0], side="right")
    for mine in np.flatnonzero(last > first):
        met = slice(first[mine], last[mine])
        fits = (other_low[met] <= most - one_low[mine]) & (other_high[met] >= least - one_high[mine])
        if all_of(fits).any():
            return True
    return False


def _choices(count: int) -> np.ndarray:
    """Return every choice among so many, (2^count, count) of 0 and 1."""
    return (np.arange(2**count)[:, np.newaxis] >> np.arange(count) & 1).astype(np.float64)


def _between(values: np.ndarray, ranges: _Ranges, lights: Lights) -> np.ndarray:
    """Return which values (pixels, 3) lie between nothing of the undecided lights and all that they could give."""
    most = _sum(np.maximum(ranges.high, ranges.most), lights.free | lights.decided)
    least = _sum(ranges.low, lights.decided)
    return all_of((values >= least - lights.step) & (values <= most + lights.step) & np.isfinite(values))


def _sum(parts: np.ndarray, counted: np.ndarray) -> np.ndarray:
    """Return the sum (pixels, 3) of the counted lights' parts (pixels, lights, 3), infinite ones among the others."""
    return np.where(counted[..., np.newaxis], parts, 0.0).sum(axis=1)


def _grazing(facing: np.ndarray, same: np.ndarray) -> np.ndarray:
    """Return the pixels (pixels,) whose object turns so fast towards its outline that samples do not tell its range.

    Near an outline the cosine to the eye goes as the root of the distance from it. Where it varies by more than a
    factor of two over the reach, or one sample alone met the object, the outline itself is within reach.
    """
    cosine = np.abs(facing)
    least, most = np.where(same, cosine, np.inf).min(axis=1), np.where(same, cosine, -np.inf).max(axis=1)
    return (facing.shape[1] > 1) & ((2 * least < most) | (same.sum(axis=1) == 1))
