"""Causes of failures that are no mistakes of formulas: blank images, no hits, steps of storage, parts not drawn.

They are searched for first; acne and noise are searched for last, in the cases that no mistake explains, because
roundings and chance decide their pixels.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from rayproof.cases.stages import IMAGE_STAGES, Resolution, Stage, StageImages
from rayproof.reference.analytic.camera import pixel_centers
from rayproof.reports.diagnosis.evidence import LEFT, MOST_LEFT, OFF_OF_WRONG, RIGHT, Evidence, off
from rayproof.reports.judge.nearby.clouds import LIGHT
from rayproof.reports.mistakes import MISTAKES, Mistake
from rayproof.reports.mistakes.light import linear_of_srgb
from rayproof.reports.mistakes.storing import undrawn


@dataclass(frozen=True, kw_only=True)
class Finding:
    """A cause of failures, and the failing cases that it explains."""

    name: str
    sentence: str  # a verb phrase; its subject is the renderer
    items: tuple[str, ...]
    cases: tuple[Evidence, ...]
    extra: tuple[type[Mistake], ...] = field(default=())


STORING = ("IMG-1",)


def blank(cases: Sequence[Evidence], failing: Sequence[Evidence]) -> Finding | None:
    """Return the finding that no ray of any case hits a shape, or that every image has a single colour, or None."""
    with_light = [case for case in cases if Stage.RADIANCE in case.images]
    flat = [
        case for case in with_light if np.ptp(case.images[Stage.RADIANCE].reshape(-1, 3), axis=0).max(initial=0) == 0
    ]
    named = [case for case in cases if Stage.OBJECT in case.images]
    if named and all((case.images[Stage.OBJECT] < 0).all() for case in named):
        explained = tuple(case for case in failing if Stage.OBJECT in case.images)
        return Finding(
            name="nothing_hit", sentence="hits nothing at all", items=("HIT-9", "HIT-2", "XF-1"), cases=explained
        )
    if not with_light or len(flat) < len(with_light) or not any(case in failing for case in flat):
        return None
    colours = {tuple(case.images[Stage.RADIANCE][0, 0]) for case in flat}
    what = "a black image" if colours == {(0.0, 0.0, 0.0)} else "an image of one colour"
    explained = tuple(case for case in failing if case in flat)
    return Finding(
        name="black" if what == "a black image" else "blank", sentence=f"writes {what}", items=STORING, cases=explained
    )


# Bytes of numbers.

WILD = 1e12  # no scene has magnitudes above this or below its reciprocal
LEAST_WILD, MOST_WILD = 0.3, 0.01  # shares of the numbers that are not 0; random bytes are wild in two thirds


def swapped(cases: Sequence[Evidence], failing: Sequence[Evidence]) -> Finding | None:
    """Return the finding that numbers are written in the other byte order, with the cases that this explains, or None.

    From then on the cases are judged by the images with the bytes in the right order. An oracle with this mistake would
    prove nothing: rounding decides the last bit of a number, which becomes its most significant bit. A NaN may have
    lost bits when it was read, so that such pixels are left out.
    """
    if not all(_wild(case.images) > LEAST_WILD and _wild(_meant(case)) <= MOST_WILD for case in failing):
        return None
    explained = []
    for case in cases:
        lost = np.zeros(case.wrong.shape, dtype=bool)
        for image in case.images.values():
            lost |= np.isnan(image).any(axis=-1)
        case.judge_instead(_meant(case))
        if case in failing and not np.any(case.wrong & ~lost):
            explained.append(case)
    mistake = MISTAKES["bytes_swapped"]
    return Finding(name=mistake.name, sentence=mistake.sentence, items=STORING, cases=tuple(explained))


def _meant(case: Evidence) -> StageImages:
    """Return the images as they were read, with the bytes of each number in the other order."""
    read = case.load()
    with np.errstate(invalid="ignore"):  # swapped bytes may be NaN
        return {stage: np.asarray(read[stage], dtype=np.float32).byteswap().astype(np.float64) for stage in case.images}


def _wild(images: StageImages) -> float:
    """Return the share of wild magnitudes (see `WILD`) among the numbers that are not 0."""
    values = np.concatenate([np.abs(image[image != 0]) for image in images.values()] or [np.zeros(0)])
    tame = (values > 1 / WILD) & (values < WILD) | np.isinf(values)
    return 1 - float(np.mean(tame)) if len(values) else 0.0


# Steps of storage.

LEAST_VALUES = 24  # distinct numbers of a stage: fewer prove no steps
STEPS = {
    255: "8 bits",
    1023: "10 bits",
    4095: "12 bits",
    65535: "16 bits",
    127: "signed 8 bits",
    32767: "signed 16 bits",
}


def _half(values: np.ndarray) -> tuple[Resolution, str] | None:
    with np.errstate(all="ignore"):
        if not np.array_equal(values.astype(np.float16).astype(np.float64), values):
            return None
    return Resolution(relative=2.0**-11, absolute=2.0**-25, because="16-bit floats"), "16-bit floats"


def _even(values: np.ndarray, *, signed: bool) -> tuple[Resolution, str] | None:
    """Return the steps if all values are integers scaled to [0, 1], or to [-1, 1] if `signed`; otherwise None."""
    if values.max() > 1 + 1e-6 or values.min() < (-1 - 1e-6 if signed else 0):
        return None
    for steps, bits in STEPS.items():
        places = (values + 1) / 2 * steps if signed else values * steps
        straight = values * steps  # the encoding of signed integers with an exact 0
        for place in (places, straight):
            if np.abs(place - np.round(place)).max() <= 1e-3 * min(1.0, 255 / steps + 0.02):
                width = 1.0 if place is places and signed else 0.5
                return Resolution(relative=0.0, absolute=width / steps, because=bits), bits
    return None


def _srgb(values: np.ndarray) -> tuple[Resolution, str] | None:
    codes = linear_of_srgb(np.arange(256) / 255)
    if values.min() < 0 or values.max() > 1 + 1e-6:
        return None
    nearest = codes[np.clip(np.searchsorted((codes[1:] + codes[:-1]) / 2, values), 0, 255)]
    if not (np.abs(nearest - values) <= 1e-6 + 1e-5 * values).all():
        return None
    # Half a step on the curve is 1.2 L / (code + 14); this resolution is at least that for every code.
    return Resolution(relative=0.012, absolute=0.0004, because="sRGB of 8 bits"), "sRGB of 8 bits"


def steps_of(stage: Stage, images: Sequence[np.ndarray]) -> tuple[Resolution, str] | None:
    """Return the steps of a stage's stored images and their name, if they are coarser than float32; otherwise None."""
    values = np.unique(np.concatenate([image[np.isfinite(image)] for image in images] or [np.zeros(0)]))
    if len(values) < LEAST_VALUES or stage in (Stage.OBJECT, Stage.VISIBILITY):
        return None
    signed = stage in (Stage.RAY, Stage.NORMAL)
    kinds: tuple[Callable[[], tuple[Resolution, str] | None], ...] = (
        lambda: _half(values),
        lambda: _srgb(values) if stage in LIGHT else None,
        lambda: _even(values, signed=signed),
    )
    return next((steps for kind in kinds if (steps := kind()) is not None), None)


def coarse(cases: Sequence[Evidence], failing: Sequence[Evidence]) -> Finding | None:
    """Return the finding that stages are stored in coarse steps, with the failing cases that this explains, or None.

    From then on the cases are judged by these steps.
    """
    steps_by_stage: dict[Stage, tuple[Resolution, str]] = {}
    for stage in IMAGE_STAGES:
        images = [case.images[stage] for case in cases if stage in case.images]
        if images and (steps := steps_of(stage, images)) is not None:
            steps_by_stage[stage] = steps
    if not steps_by_stage:
        return None
    explained = []
    for case in cases:
        before = int(np.count_nonzero(case.wrong)) if case in failing else 0
        case.judge_by({stage: steps for stage, (steps, _) in steps_by_stage.items()})
        if case in failing and np.count_nonzero(case.wrong) <= min(LEFT * before, MOST_LEFT * case.wrong.size):
            explained.append(case)
    words = " and ".join(dict.fromkeys(f"{stage} in {bits}" for stage, (_, bits) in steps_by_stage.items()))
    half = all(bits == "16-bit floats" for _, bits in steps_by_stage.values())
    if half:
        words = "its values in 16-bit floats"
    name = "half_floats" if half else "too_few_bits"
    return Finding(name=name, sentence=f"stores {words}", items=STORING, cases=tuple(explained))


# Parts that are not drawn.

SIDES = (1, 2, 4, 8, 16, 32, 64)  # px: heights of strips, widths of columns, sides of tiles
THREADS = range(2, 33)  # numbers of threads that may share an image in strips
LEAST_CUTS = 30  # wrong pixels next to right ones, across a border of the undrawn parts
LEAST_LINES = 2  # borders of undrawn parts in an image, if there is no second image of its size to confirm them


def not_drawn(failing: Sequence[Evidence]) -> list[type[Mistake]]:
    """Return a list of the mistake that whole strips, columns or tiles are left undrawn; empty if unproven."""
    values = _blank_values(failing[0]) if failing else None
    if values is None:
        return []
    by_size: dict[tuple[int, int], list[Evidence]] = {}
    for case in failing:
        by_size.setdefault(case.wrong.shape, []).append(case)
    parts: dict[tuple[int, int], np.ndarray] = {}
    cuts, foretold = 0, False
    for (height, width), cases in by_size.items():
        blank_pixels = [(case, _holds(case, values)) for case in cases[::2]]
        for grid in _grids(height, width):
            where = np.zeros((height, width), dtype=bool)
            for case, empty in blank_pixels:
                where |= _empty_cells(grid, empty, case.wrong)
            if all(np.count_nonzero(case.wrong & ~where) <= MOST_LEFT * case.wrong.size for case, _ in blank_pixels):
                parts[height, width] = where
                cuts += sum(_cuts(case, where) for case, _ in blank_pixels)
                foretold |= len(cases) > 1 or _lines(where) >= LEAST_LINES
                break
    proven = cuts >= LEAST_CUTS and foretold
    return [undrawn(parts, values, "whole strips or tiles")] if proven else []


def _blank_values(case: Evidence) -> dict[Stage, np.ndarray] | None:
    """Return the value (channels,) of at least half of a case's wrong pixels per stage, or None if there is none."""
    values_by_stage = {}
    for stage in case.stages:
        values, count = np.unique(case.images[stage][case.wrong], axis=0, return_counts=True)
        if not len(count) or count.max() < 0.5 * count.sum():
            return None
        values_by_stage[stage] = (
            values[np.argmax(count)] if stage is not Stage.VISIBILITY else values[np.argmax(count)][:1]
        )
    return values_by_stage


def _holds(case: Evidence, blank_values: Mapping[Stage, np.ndarray]) -> np.ndarray:
    pixels = np.ones(case.wrong.shape, dtype=bool)
    for stage, value in blank_values.items():
        if stage in case.images:
            pixels &= np.all((case.images[stage] == value) | (np.isnan(case.images[stage]) & np.isnan(value)), axis=-1)
    return pixels


def _grids(height: int, width: int) -> Iterator[np.ndarray]:
    """Yield the number of each pixel's cell (height, width) for each division of an image, coarse divisions first."""
    rows, columns = np.indices((height, width))
    strips = {size for size in SIDES if size < height}
    strips |= {size for threads in THREADS for size in (height // threads, -(-height // threads)) if size}
    yield from (rows // size for size in sorted(strips, reverse=True))
    yield from (columns // size for size in sorted((size for size in SIDES if size < width), reverse=True))
    for size in sorted((size for size in SIDES if 4 <= size < max(height, width)), reverse=True):
        yield rows // size * width + columns // size


def _empty_cells(grid: np.ndarray, empty: np.ndarray, wrong: np.ndarray) -> np.ndarray:
    """Return the pixels (height, width) of cells that contain a wrong pixel and only `empty` pixels."""
    drawn, faulty = np.zeros(int(grid.max()) + 1, dtype=bool), np.zeros(int(grid.max()) + 1, dtype=bool)
    drawn[grid[~empty]], faulty[grid[wrong]] = True, True
    return np.asarray((faulty & ~drawn)[grid])


def _cuts(case: Evidence, where: np.ndarray) -> int:
    """Return the number of pairs of a wrong and a right pixel side by side, across a border of the undrawn parts."""
    truth = case.right.base.truth
    surface = (
        truth[Stage.OBJECT][..., 0] >= 0 if Stage.OBJECT in case.images else (truth[Stage.RADIANCE] > 0).any(axis=-1)
    )
    wrong, good = where & case.wrong, ~where & ~case.wrong & surface
    pairs = ((np.s_[1:], np.s_[:-1]), (np.s_[:, 1:], np.s_[:, :-1]))
    return sum(int(np.count_nonzero(wrong[a] & good[b]) + np.count_nonzero(wrong[b] & good[a])) for a, b in pairs)


def _lines(where: np.ndarray) -> int:
    """Return the number of rows and columns at which an undrawn part begins or ends inside the image."""
    rows, columns = where[1:] != where[:-1], where[:, 1:] != where[:, :-1]
    return int(np.count_nonzero(rows.any(axis=1)) + np.count_nonzero(columns.any(axis=0)))


# Acne, and noise.

DARKENED = 0.98  # least share of the wrong pixels that are black
SCATTERED = 0.8  # least share of the dark pixels next to a right pixel of the same shape: in a region, only its rim
LEAST_DARK = 30  # pixels of a case: a smaller region is nearly all rim
LEAST_CASES = 3  # cases with such pixels; all cases if there are fewer
LEAST_NOISY = 0.2  # least share of the lit pixels that are wrong
CORRELATED = 0.3  # correlation of neighbours' relative errors: errors of a wrong formula are alike


def acne(left: Sequence[Evidence]) -> Finding | None:
    """Return the finding that surfaces shadow themselves, if dark points are scattered over lit surfaces, or None."""
    explained = [case for case in left if _scattered(case)]
    if len(explained) < min(LEAST_CASES, len(left)) or not explained:
        return None
    sentence = "lets surfaces shadow themselves, so that scattered points of them are dark (shadow acne)"
    return Finding(name="acne", sentence=sentence, items=("LIT-2", "LIT-3", "LIT-4", "LIT-5"), cases=tuple(explained))


def _scattered(case: Evidence) -> bool:
    stage = Stage.VISIBILITY if Stage.VISIBILITY in case.images else Stage.RADIANCE
    if len(case.scene.lights) != 1 or stage not in case.images:
        return False
    truth, wrong = case.right.base.truth, case.wrong
    dark = wrong & (truth[stage] > 0).any(axis=-1) & (case.images[stage] == 0).all(axis=-1)
    count = np.count_nonzero(dark)
    if count < LEAST_DARK or np.count_nonzero(wrong & ~dark) > max(0.005 * wrong.size, (1 - DARKENED) * wrong.sum()):
        return False
    good, objects = (truth[stage] > 0).any(axis=-1) & ~wrong, truth[Stage.OBJECT][..., 0]
    beside = np.zeros_like(dark)
    for first, second in ((np.s_[1:], np.s_[:-1]), (np.s_[:, 1:], np.s_[:, :-1])):
        same = objects[first] == objects[second]
        beside[first] |= same & good[second]
        beside[second] |= same & good[first]
    return bool(np.count_nonzero(dark & beside) >= SCATTERED * count)


LEAST_OF_A_LIGHT = 0.1  # least share of the lit wrong pixels with the radiance of a light for it to count as drawn


def one_light(left: Sequence[Evidence]) -> Finding | None:
    """Return the finding that each sample draws a random light and counts it for all of them, or None."""
    explained = tuple(case for case in left if _of_one_light(case))
    sentence = "draws one of several lights at random for each sample, and counts it for all of them"
    return (
        Finding(name="one_light_at_random", sentence=sentence, items=("RAD-5",), cases=explained) if explained else None
    )


def _of_one_light(case: Evidence) -> bool:
    count, stage = len(case.scene.lights), Stage.RADIANCE
    if count < 2 or stage not in case.images:
        return False
    pixels, wrong = case.drawn
    with np.errstate(all="ignore"):
        right = RIGHT.samples(case.scene, pixel_centers(case.scene.camera)[pixels], stage, by_light=True)
        assert right.shares is not None
        light_values = (
            right.shares * right.rows[Stage.VISIBILITY][..., np.newaxis] * right.factors[stage][:, np.newaxis]
        )
        light_values = np.nan_to_num(count * light_values) * (right.rows[stage] > 0)[:, np.newaxis]
    is_of = ~off(stage, case.own[stage][:, np.newaxis], light_values)  # (n, lights)
    lit = wrong & (case.own[stage] > 0).any(axis=1)
    several = np.count_nonzero(is_of[lit].mean(axis=0) >= LEAST_OF_A_LIGHT) if lit.any() else 0
    return bool(several > 1 and is_of[wrong].any(axis=1).mean() >= 1 - OFF_OF_WRONG)


def noise(left: Sequence[Evidence]) -> Finding | None:
    """Return the finding that radiance scatters about the right values, if it does so in at least half of the cases."""
    explained = [case for case in left if _noisy(case)]
    if not explained or 2 * len(explained) < len(left):
        return None
    sentence = "scatters its radiance about the right values from pixel to pixel, as sampling at random does"
    return Finding(name="noise", sentence=sentence, items=("RAD-5", "CAM-3"), cases=tuple(explained))


def _noisy(case: Evidence) -> bool:
    if Stage.RADIANCE not in case.images:
        return False
    truth, own = (image.sum(axis=-1) for image in (case.right.base.truth[Stage.RADIANCE], case.images[Stage.RADIANCE]))
    lit = truth > 0
    if np.count_nonzero(lit & case.wrong) < max(200, LEAST_NOISY * np.count_nonzero(lit)):
        return False
    with np.errstate(all="ignore"):
        off = np.clip(np.where(lit, own / truth - 1, 0.0), -4, 4)
    objects = case.right.base.truth[Stage.OBJECT][..., 0]
    for after, before in ((np.s_[1:], np.s_[:-1]), (np.s_[:, 1:], np.s_[:, :-1])):
        pairs = (
            lit[after] & lit[before] & (case.wrong[after] | case.wrong[before]) & (objects[after] == objects[before])
        )
        first, second = off[after][pairs], off[before][pairs]
        if len(first) < 100 or first.std() == 0 or second.std() == 0:
            return False
        if not abs(float(np.corrcoef(first, second)[0, 1])) < CORRELATED:
            return False
    mean = float(off[lit & case.wrong].mean())
    return abs(mean) < 0.5 * float(off[lit & case.wrong].std())
