"""Findings about images as a whole: blank images, no hits, swapped bytes, coarse storage, undrawn parts, acne, noise.

They are not mistakes of a formula. Most are reported before the search for mistakes. Acne and noise are reported last,
for cases that nothing else explains, since rounding and chance decide their pixels.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from rayproof.cases.stages import IMAGE_STAGES, Resolution, Stage, StageImages
from rayproof.reports.diagnosis.evidence import LEFT, MOST_LEFT, Evidence
from rayproof.reports.judge.nearby.clouds import LIGHT
from rayproof.reports.mistakes import MISTAKES, Mistake
from rayproof.reports.mistakes.light import linear_of_srgb
from rayproof.reports.mistakes.storing import undrawn


@dataclass(frozen=True, kw_only=True)
class Finding:
    """A finding about images, and the failing cases that it explains."""

    name: str
    sentence: str  # a verb phrase whose grammatical subject is the renderer
    items: tuple[str, ...]
    cases: tuple[Evidence, ...]
    extra: tuple[type[Mistake], ...] = field(default=())


STORING = ("IMG-1",)


def blank(cases: Sequence[Evidence], failing: Sequence[Evidence]) -> Finding | None:
    """Return the finding that every image has one colour or that no ray hits a shape, in every case; otherwise None."""
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


# Order of bytes.

WILD = 1e12  # no scene has magnitudes above this or below its reciprocal; such numbers are wild
LEAST_WILD, MOST_WILD = 0.3, 0.01  # shares of the nonzero numbers, before and after swapping; of random bytes 2/3


def swapped(cases: Sequence[Evidence], failing: Sequence[Evidence]) -> Finding | None:
    """Return the finding that the bytes of numbers are in reversed order, with the failing cases that it explains.

    Return None otherwise. After this call, the cases are judged by the decoded images. A mistake of the registry could
    not explain them: rounding changes the last bit of a number, which becomes the most significant one. A stored NaN
    may have lost bits; such pixels do not count.
    """
    meant = [{stage: _swapped(image) for stage, image in case.images.items()} for case in failing]
    if not all(
        _wild(case.images) > LEAST_WILD and _wild(images) <= MOST_WILD
        for case, images in zip(failing, meant, strict=True)
    ):
        return None
    explained = []
    for case in cases:
        lost = np.zeros(case.wrong.shape, dtype=bool)
        for image in case.images.values():
            lost |= np.isnan(image).any(axis=-1)
        case.judge_instead({stage: _swapped(image) for stage, image in case.images.items()})
        if case in failing and not np.any(case.wrong & ~lost):
            explained.append(case)
    mistake = MISTAKES["bytes_swapped"]
    return Finding(name=mistake.name, sentence=mistake.sentence, items=STORING, cases=tuple(explained))


def _swapped(image: np.ndarray) -> np.ndarray:
    with np.errstate(invalid="ignore"):  # swapped bytes may be a signalling NaN
        return np.asarray(image, dtype=np.float32).byteswap().astype(np.float64)


def _wild(images: StageImages) -> float:
    """Return the share of the nonzero numbers whose magnitude no scene has."""
    values = np.concatenate([np.abs(image[image != 0]) for image in images.values()] or [np.zeros(0)])
    tame = (values > 1 / WILD) & (values < WILD) | np.isinf(values)
    return 1 - float(np.mean(tame)) if len(values) else 0.0


# Steps of storage.

LEAST_VALUES = 24  # distinct numbers of a stage; fewer are too few to recognise steps
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
    """Return the steps of integers that are mapped to 0 to 1, or to -1 to 1 if `signed`; None for other values."""
    if values.max() > 1 + 1e-6 or values.min() < (-1 - 1e-6 if signed else 0):
        return None
    for steps, bits in STEPS.items():
        places = (values + 1) / 2 * steps if signed else values * steps
        straight = values * steps  # signed integers, which represent 0 exactly
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
    # Half a step of the curve is 1.2 L / (code + 14); this resolution covers it from the darkest to the brightest code.
    return Resolution(relative=0.012, absolute=0.0004, because="sRGB of 8 bits"), "sRGB of 8 bits"


def steps_of(stage: Stage, images: Sequence[np.ndarray]) -> tuple[Resolution, str] | None:
    """Return the resolution at which a stage's images are stored, with its name; None if it is that of float32."""
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
    """Return the finding that stages are stored in coarse steps, with the failing cases where nothing else is wrong.

    Return None otherwise. After this call, the cases are judged with these resolutions.
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
THREADS = range(2, 33)  # numbers of threads; a renderer may give each thread a strip of the image
LEAST_CUTS = 30  # pairs of adjacent pixels, a drawn and an undrawn one, that prove undrawn parts
LEAST_LINES = 2  # borders of undrawn parts that an image must have if no second image of its size confirms them


def not_drawn(failing: Sequence[Evidence]) -> list[type[Mistake]]:
    """Return the mistake of leaving strips, columns or tiles of images undrawn, in a list; an empty list if unproven.

    Every second case of a size determines its undrawn parts; the search then tests the mistake on all cases.
    """
    blank_values = _blank_values(failing[0]) if failing else None
    if blank_values is None:
        return []
    by_size: dict[tuple[int, int], list[Evidence]] = {}
    for case in failing:
        by_size.setdefault(case.wrong.shape, []).append(case)
    parts: dict[tuple[int, int], np.ndarray] = {}
    cuts, foretold = 0, False
    for (height, width), cases in by_size.items():
        shown = [(case, _holds(case, blank_values)) for case in cases[::2]]
        for grid in _grids(height, width):
            where = np.zeros((height, width), dtype=bool)
            for case, empty in shown:
                where |= _empty_cells(grid, empty, case.wrong)
            if all(np.count_nonzero(case.wrong & ~where) <= MOST_LEFT * case.wrong.size for case, _ in shown):
                parts[height, width] = where
                cuts += sum(_cuts(case, where) for case, _ in shown)
                foretold |= len(cases) > 1 or _lines(where) >= LEAST_LINES
                break
    proven = cuts >= LEAST_CUTS and foretold
    return [undrawn(parts, blank_values, "whole strips or tiles")] if proven else []


def _blank_values(case: Evidence) -> dict[Stage, np.ndarray] | None:
    """Return the value (channels,) of most wrong pixels of a case by stage; None if no value has the majority."""
    most_common = {}
    for stage in case.stages:
        values, count = np.unique(case.images[stage][case.wrong], axis=0, return_counts=True)
        if not len(count) or count.max() < 0.5 * count.sum():
            return None
        most_common[stage] = values[np.argmax(count)] if stage is not Stage.VISIBILITY else values[np.argmax(count)][:1]
    return most_common


def _holds(case: Evidence, blank_values: Mapping[Stage, np.ndarray]) -> np.ndarray:
    empty = np.ones(case.wrong.shape, dtype=bool)
    for stage, value in blank_values.items():
        if stage in case.images:
            empty &= np.all((case.images[stage] == value) | (np.isnan(case.images[stage]) & np.isnan(value)), axis=-1)
    return empty


def _grids(height: int, width: int) -> Iterator[np.ndarray]:
    """Yield partitions of an image as the cell index of each pixel, (height, width); coarse partitions first."""
    rows, columns = np.indices((height, width))
    strips = {size for size in SIDES if size < height}
    strips |= {size for threads in THREADS for size in (height // threads, -(-height // threads)) if size}
    yield from (rows // size for size in sorted(strips, reverse=True))
    yield from (columns // size for size in sorted((size for size in SIDES if size < width), reverse=True))
    for size in sorted((size for size in SIDES if 4 <= size < max(height, width)), reverse=True):
        yield rows // size * width + columns // size


def _empty_cells(grid: np.ndarray, empty: np.ndarray, wrong: np.ndarray) -> np.ndarray:
    """Return a mask (height, width) of the cells that have wrong pixels, and only empty pixels."""
    with_drawn, with_wrong = np.zeros(int(grid.max()) + 1, dtype=bool), np.zeros(int(grid.max()) + 1, dtype=bool)
    with_drawn[grid[~empty]], with_wrong[grid[wrong]] = True, True
    return np.asarray((with_wrong & ~with_drawn)[grid])


def _cuts(case: Evidence, where: np.ndarray) -> int:
    """Return the number of pairs of a wrong undrawn and an adjacent right pixel, on both sides of an undrawn border."""
    truth = case.right.base.truth
    visible = (
        truth[Stage.OBJECT][..., 0] >= 0 if Stage.OBJECT in case.images else (truth[Stage.RADIANCE] > 0).any(axis=-1)
    )
    wrong, good = where & case.wrong, ~where & ~case.wrong & visible
    pairs = ((np.s_[1:], np.s_[:-1]), (np.s_[:, 1:], np.s_[:, :-1]))
    return sum(int(np.count_nonzero(wrong[a] & good[b]) + np.count_nonzero(wrong[b] & good[a])) for a, b in pairs)


def _lines(where: np.ndarray) -> int:
    """Return the number of rows and columns inside the image where an undrawn part begins or ends."""
    rows, columns = where[1:] != where[:-1], where[:, 1:] != where[:, :-1]
    return int(np.count_nonzero(rows.any(axis=1)) + np.count_nonzero(columns.any(axis=0)))


# Acne, and noise.

DARKENED = 0.98  # share of the wrong pixels that must be dark
SCATTERED = 0.8  # share of the dark pixels with an adjacent right pixel of the same shape; in a region only its edge
LEAST_DARK = 30  # dark pixels of a case; a smaller region consists mostly of its edge
LEAST_CASES = 3  # cases with acne that are needed, or all cases if there are fewer
LEAST_NOISY = 0.2  # share of the lit pixels
CORRELATED = 0.3  # correlation of adjacent relative errors; the errors of a wrong formula correlate more


def acne(left: Sequence[Evidence]) -> Finding | None:
    """Return the finding of shadow acne, if dark points are scattered over lit surfaces in enough cases."""
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
    for after, before in ((np.s_[1:], np.s_[:-1]), (np.s_[:, 1:], np.s_[:, :-1])):
        same = objects[after] == objects[before]
        beside[after] |= same & good[before]
        beside[before] |= same & good[after]
    return bool(np.count_nonzero(dark & beside) >= SCATTERED * count)


def noise(left: Sequence[Evidence]) -> Finding | None:
    """Return the finding of noise, if radiance scatters about the right values in at least half of the cases."""
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
