"""Whether an edge pixel's value is that of a side (`excused`), and whether some choice of lights gives it (`held`)."""

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage, StageImages
from rayproof.reports.judge.answers import all_of, dot, largest, length, limit_near
from rayproof.reports.judge.edge_sides import SPARE, Sides


class LightEnd(Protocol):
    """A light near a shape's surface, and the pixels whose view of it hangs on which side of the surface it lies."""

    light: int
    shape: int
    face: int
    gap: float  # m
    pixels: np.ndarray  # (height, width)
    depth: np.ndarray  # (height, width) m: how deep below a curved surface the way to the light gets just before it
    chord: np.ndarray  # (height, width) m: how far before the light it enters there


class Edges(Protocol):
    """The oracle's distances to the nearest edge [px]; inf where there is none."""

    silhouette: np.ndarray  # (height, width)
    covered: np.ndarray  # (height, width): edges count, too, that what is seen hides by less than float32's rounding
    shadow: np.ndarray  # (height, width, lights)
    terminator: np.ndarray  # (height, width, lights)
    gap: np.ndarray  # (height, width) m: along the ray from the hit to the nearest other surface
    behind: np.ndarray  # (height, width): that surface's shape, -1 without one
    clip_depth: np.ndarray  # (height, width) m: where the ray meets the surface nearest to an end of clipping
    at_clip: np.ndarray  # (height, width): that surface's shape, -1 without one
    light_ends: Sequence[LightEnd]
    eye_gaps: np.ndarray  # (shapes,) m, of each shape: how far its surface is from the eye at least


def excused(
    stage: Stage,
    ours: StageImages,
    around: Sides,
    limit: np.ndarray,
    objects: np.ndarray,
    *,
    continued: bool,
) -> np.ndarray:
    """Return the pixels (height, width) whose value at `stage` is a side's: same object, value among that object's.

    `objects` (height, width) is the shape that the oracle sees. End to end "among" means within the samples' range,
    since a distance changes fast towards an outline. Continued from the tracer's own position a normal has no such
    freedom: it must be one of the samples'.
    """
    seen = ours[Stage.OBJECT][around.rows, around.columns]
    return _excused(stage, ours, around, limit, objects, seen, continued=continued)


def _excused(
    stage: Stage,
    ours: StageImages,
    around: Sides,
    limit: np.ndarray,
    objects: np.ndarray,
    seen: np.ndarray,
    *,
    continued: bool,
) -> np.ndarray:
    """Return the same where the renderer saw the objects `seen` (pixels, 2)."""
    good = np.zeros(objects.shape, dtype=bool)
    if not len(around.rows):
        return good
    rows, columns = around.rows, around.columns
    own = seen[:, np.newaxis]
    same = all_of(around.answers[Stage.OBJECT] == own)
    if stage is Stage.OBJECT:
        np.logical_or.at(good, (rows, columns), same.any(axis=1))
        return good
    mask = same[..., np.newaxis]
    with np.errstate(invalid="ignore"):
        theirs = around.answers[stage]
        low = np.where(mask, theirs, np.inf).min(axis=1)
        high = np.where(mask, theirs, -np.inf).max(axis=1)
        bound = largest(limit) if limit.ndim == 3 else limit
        kinds, kind = np.unique(own[:, 0, 0], return_inverse=True)
        bounds = np.stack([limit_near(objects, bound, index)[rows, columns] for index in kinds])
        bound = bounds[kind, np.arange(len(rows))][:, np.newaxis]
        value, ends = ours[stage][rows, columns], (low, high)
        span = np.where(np.isfinite(high - low), around.spare * (high - low), 0.0)
        low, high = low - span, high + span
        if stage is Stage.DISTANCE:
            # Of a plane the inverse is linear in the image: towards its horizon the distance itself has no bound.
            low, farthest = _beyond(*ends, around.spare)
            high = np.where(np.isin(own[..., 0], around.endless), farthest, high)
        if continued and stage is Stage.NORMAL:
            near = length(value[:, np.newaxis] - theirs) <= bound
            np.logical_or.at(good, (rows, columns), np.any(near & same, axis=1))
            return good
        inside = all_of((value >= low - bound) & (value <= high + bound)) & same.any(axis=1)
        if stage is Stage.NORMAL:
            # A range of directions holds others' lengths as well.
            apart = np.abs(length(value)[:, np.newaxis] - length(theirs))
            inside &= np.where(same, apart, np.inf).min(axis=1) <= bound[:, 0]
        np.logical_or.at(good, (rows, columns), inside)
    return good


def _beyond(low: np.ndarray, high: np.ndarray, spare: float) -> tuple[np.ndarray, np.ndarray]:
    """Return distances [m] whose inverses reach beyond those of a range by a share of what they span."""
    with np.errstate(divide="ignore", invalid="ignore"):
        most, least = 1 / low, 1 / high
        span = np.where(np.isfinite(low) & (low > 0), spare * (most - least), 0.0)
        return 1 / (most + span), np.where(least > span, 1 / (least - span), np.where(span > 0, np.inf, high))


def excused_anyhow(
    stage: Stage, ours: StageImages, around: Sides, limit: np.ndarray, objects: np.ndarray, *, continued: bool
) -> np.ndarray:
    """Return the same for a renderer that does not say which object it saw: any that the oracle meets there will do."""
    good = np.zeros(objects.shape, dtype=bool)
    seen = around.answers[Stage.OBJECT]
    for sample in range(seen.shape[1]):
        good |= _excused(stage, ours, around, limit, objects, seen[:, sample], continued=continued)
    return good


# What light may be at an edge: of some object seen there, each undecided light's whole contribution or nothing of it.
#
# A light's unshadowed contribution is Phi cos / (4 pi r^2), or Phi cos under simplified shading, times the albedo for
# the exitance and over pi for the radiance (RAD-1 to RAD-4). Over the edge's reach it has a range; which lights are
# counted is a choice, and all three channels must be given by the same one. So no value passes because it lies near
# an edge.


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
    spare: float = SPARE  # how far beyond the samples a value may lie, as a share of what they span


@dataclass(frozen=True, kw_only=True)
class Lights:
    """What is known of each light at some pixels (pixels, lights), and of the rounding there."""

    decided: np.ndarray  # counted in every choice
    free: np.ndarray  # counted or not
    close: np.ndarray  # so near to the point that rounding decides how much arrives
    relative: np.ndarray  # (pixels, samples, lights): error of cos / r^2, of a light straight above
    rounding: float  # relative error of what follows from irradiance
    step: np.ndarray  # (pixels, 3): how coarse the outputs are

    def of(self, rows: np.ndarray) -> "Lights":
        """Return the same of some of the pixels."""
        images = ("decided", "free", "close", "relative", "step")
        return replace(self, **{name: getattr(self, name)[rows] for name in images})


@dataclass(frozen=True, kw_only=True)
class Held:
    """Which of some pixels have the value of a side, and which of those only lie within an interval."""

    good: np.ndarray
    interval: np.ndarray


def held(scene: Scene, stage: Stage, values: np.ndarray, seen: Seen, lights: Lights) -> Held:
    """Say of values (pixels, 3) of a stage of light whether some object and some choice of lights gives them."""
    exactly, within = np.zeros(len(values), dtype=bool), np.zeros(len(values), dtype=bool)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        straight, cosine = _arriving(scene, stage, seen)
        for rows, same in _objects(seen.objects):
            value, known = values[rows], lights.of(rows)
            ranges = _ranges(straight[rows], cosine[rows], same, known, seen.spare)
            listed = _listed(value, ranges, known) | _met(value, ranges, known)
            between = _between(value, ranges, known)
            counted = known.free | known.decided
            many = np.count_nonzero(known.free, axis=1) > MOST_LISTED
            unbounded = many | (known.close & counted).any(axis=1)
            np.logical_or.at(exactly, rows, listed & ~(known.close & counted).any(axis=1))
            np.logical_or.at(within, rows, between & unbounded)
    return Held(good=exactly | within, interval=within & ~exactly)


def _arriving(scene: Scene, stage: Stage, seen: Seen) -> tuple[np.ndarray, np.ndarray]:
    """Return what each light would give from straight above (pixels, samples, lights, 3), and its cosine."""
    index = seen.objects[..., 0].astype(int)
    known = (index >= 0) & (index < len(scene.shapes))
    albedo = np.array([*(shape.albedo for shape in scene.shapes), (0.0, 0.0, 0.0)], dtype=np.float64)
    factor = np.where(known[..., np.newaxis], albedo[np.where(known, index, -1)], 0.0)
    if stage is Stage.IRRADIANCE:
        factor = np.where(known[..., np.newaxis], 1.0, 0.0)
    elif stage is Stage.RADIANCE:
        factor = np.where(dot(seen.normals, seen.rays)[..., np.newaxis] < 0, factor, 0.0)
        factor = factor if scene.shading == "simplified" else factor / math.pi
    straight, cosine = [], []
    for light in scene.lights:
        toward = np.asarray(light.position, dtype=np.float64) - seen.positions
        r = length(toward)
        flux = np.asarray(light.flux, dtype=np.float64) * factor
        straight.append(flux if scene.shading == "simplified" else flux / (4 * math.pi * r[..., np.newaxis] ** 2))
        cosine.append(np.clip(dot(seen.normals, toward) / r, 0.0, 1.0))
    return np.stack(straight, axis=-2), np.stack(cosine, axis=-1)


def _objects(objects: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield pixels (n,), each once for each object of its samples, and which of these (n, samples) see that one."""
    left = np.ones(objects.shape[:2], dtype=bool)
    pixels, each = [np.zeros(0, dtype=int)], [left[:0]]
    while len(rows := np.flatnonzero(left.any(axis=1))):
        same = all_of(objects[rows] == objects[rows, left[rows].argmax(axis=1)][:, np.newaxis])
        left[rows] &= ~same
        pixels, each = [*pixels, rows], [*each, same]
    rows, same = np.concatenate(pixels), np.concatenate(each)
    for start in range(0, len(rows), AT_ONCE):
        yield rows[start : start + AT_ONCE], same[start : start + AT_ONCE]


@dataclass(frozen=True, kw_only=True)
class _Ranges:
    """What each light may add (pixels, lights, 3): over what is seen of one object, and at the very most."""

    low: np.ndarray
    high: np.ndarray
    most: np.ndarray


def _ranges(straight: np.ndarray, cosine: np.ndarray, same: np.ndarray, lights: Lights, spare: float) -> _Ranges:
    """Return the ranges over the samples (pixels, samples) that see the `same` object."""
    mask = same[..., np.newaxis, np.newaxis]
    each = straight * cosine[..., np.newaxis]
    low, high = np.where(mask, each, np.inf).min(axis=1), np.where(mask, each, -np.inf).max(axis=1)
    most = np.where(mask, straight, -np.inf).max(axis=1)
    span = spare * (high - low)
    relative = np.where(same[..., np.newaxis], lights.relative, 0.0).max(axis=1)
    error = most * relative[..., np.newaxis] + lights.rounding * most
    close = lights.close[..., np.newaxis]
    return _Ranges(
        low=np.where(close, 0.0, np.maximum(low - span - error, 0.0)),  # no light takes any away
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
