"""What is no mistake of a formula, and is said first: blank images, nothing hit, steps of storage, parts not drawn.

Acne and noise are told last, of what nothing else explains: roundings and chance decide their pixels.
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
    """What was found out about images, and in which failing cases it is to blame."""

    name: str
    sentence: str  # a verb phrase of which the renderer is the subject
    items: tuple[str, ...]
    cases: tuple[Evidence, ...]
    extra: tuple[type[Mistake], ...] = field(default=())


STORING = ("IMG-1",)


def blank(cases: Sequence[Evidence], failing: Sequence[Evidence]) -> Finding | None:
    """Return that every image is of one colour, or that no ray hits anything, if that is so in every case."""
    with_light = [case for case in cases if Stage.RADIANCE in case.images]
    flat = [
        case for case in with_light if np.ptp(case.images[Stage.RADIANCE].reshape(-1, 3), axis=0).max(initial=0) == 0
    ]
    named = [case for case in cases if Stage.OBJECT in case.images]
    if named and all((case.images[Stage.OBJECT] < 0).all() for case in named):
        told = tuple(case for case in failing if Stage.OBJECT in case.images)
        return Finding(name="nothing_hit", sentence="hits nothing at all", items=("HIT-9", "HIT-2", "XF-1"), cases=told)
    if not with_light or len(flat) < len(with_light) or not any(case in failing for case in flat):
        return None
    colours = {tuple(case.images[Stage.RADIANCE][0, 0]) for case in flat}
    what = "a black image" if colours == {(0.0, 0.0, 0.0)} else "an image of one colour"
    told = tuple(case for case in failing if case in flat)
    return Finding(
        name="black" if what == "a black image" else "blank", sentence=f"writes {what}", items=STORING, cases=told
    )


# Bytes of numbers.

WILD = 1e12  # magnitudes beyond it, and below its reciprocal, are no scene's
LEAST_WILD, MOST_WILD = 0.3, 0.01  # of the numbers that are not 0: of any bytes two thirds are wild


def swapped(cases: Sequence[Evidence], failing: Sequence[Evidence]) -> Finding | None:
    """Return that the bytes of numbers are written in the other order, and in which failing cases that is all.

    From then on the cases are judged by what was meant. As a mistake this would tell nothing: the last bit of a number,
    which is a matter of rounding, is its greatest one. What reads as no number may have lost a bit.
    """
    meant = [{stage: _swapped(image) for stage, image in case.images.items()} for case in failing]
    if not all(
        _wild(case.images) > LEAST_WILD and _wild(images) <= MOST_WILD
        for case, images in zip(failing, meant, strict=True)
    ):
        return None
    told = []
    for case in cases:
        lost = np.zeros(case.wrong.shape, dtype=bool)
        for image in case.images.values():
            lost |= np.isnan(image).any(axis=-1)
        case.judge_instead({stage: _swapped(image) for stage, image in case.images.items()})
        if case in failing and not np.any(case.wrong & ~lost):
            told.append(case)
    mistake = MISTAKES["bytes_swapped"]
    return Finding(name=mistake.name, sentence=mistake.sentence, items=STORING, cases=tuple(told))


def _swapped(image: np.ndarray) -> np.ndarray:
    with np.errstate(invalid="ignore"):  # swapped bytes may be no number
        return np.asarray(image, dtype=np.float32).byteswap().astype(np.float64)


def _wild(images: StageImages) -> float:
    """Return the share of numbers, of those that are not 0, that are of a size that no scene has."""
    values = np.concatenate([np.abs(image[image != 0]) for image in images.values()] or [np.zeros(0)])
    tame = (values > 1 / WILD) & (values < WILD) | np.isinf(values)
    return 1 - float(np.mean(tame)) if len(values) else 0.0


# Steps of storage.

LEAST_VALUES = 24  # distinct numbers of a stage: fewer tell nothing of steps
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
    """Return the steps of whole numbers over 0 to 1, or over -1 to 1."""
    if values.max() > 1 + 1e-6 or values.min() < (-1 - 1e-6 if signed else 0):
        return None
    for steps, bits in STEPS.items():
        places = (values + 1) / 2 * steps if signed else values * steps
        straight = values * steps  # of signed whole numbers, 0 is a number
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
    # Half a step is 1.2 L / (code + 14) on the curve, which this covers from the darkest to the brightest code.
    return Resolution(relative=0.012, absolute=0.0004, because="sRGB of 8 bits"), "sRGB of 8 bits"


def steps_of(stage: Stage, images: Sequence[np.ndarray]) -> tuple[Resolution, str] | None:
    """Return the steps in which a stage's images are stored, if these are coarser than those of floats."""
    values = np.unique(np.concatenate([image[np.isfinite(image)] for image in images] or [np.zeros(0)]))
    if len(values) < LEAST_VALUES or stage in (Stage.OBJECT, Stage.VISIBILITY):
        return None
    signed = stage in (Stage.RAY, Stage.NORMAL)
    kinds: tuple[Callable[[], tuple[Resolution, str] | None], ...] = (
        lambda: _half(values),
        lambda: _srgb(values) if stage in LIGHT else None,
        lambda: _even(values, signed=signed),
    )
    return next((found for kind in kinds if (found := kind()) is not None), None)


def coarse(cases: Sequence[Evidence], failing: Sequence[Evidence]) -> Finding | None:
    """Return in which steps stages are stored, and in which failing cases nothing else is wrong.

    From then on the cases are judged by these steps.
    """
    found: dict[Stage, tuple[Resolution, str]] = {}
    for stage in IMAGE_STAGES:
        images = [case.images[stage] for case in cases if stage in case.images]
        if images and (steps := steps_of(stage, images)) is not None:
            found[stage] = steps
    if not found:
        return None
    told = []
    for case in cases:
        before = int(np.count_nonzero(case.wrong)) if case in failing else 0
        case.judge_by({stage: steps for stage, (steps, _) in found.items()})
        if case in failing and np.count_nonzero(case.wrong) <= min(LEFT * before, MOST_LEFT * case.wrong.size):
            told.append(case)
    words = " and ".join(dict.fromkeys(f"{stage} in {bits}" for stage, (_, bits) in found.items()))
    half = all(bits == "16-bit floats" for _, bits in found.values())
    if half:
        words = "its values in 16-bit floats"
    name = "half_floats" if half else "too_few_bits"
    return Finding(name=name, sentence=f"stores {words}", items=STORING, cases=tuple(told))


# Parts that are not drawn.

SIDES = (1, 2, 4, 8, 16, 32, 64)  # px: heights of strips, widths of columns, sides of tiles
THREADS = range(2, 33)  # among so many an image is shared out in strips
LEAST_CUTS = 30  # pixels beside which, on one and the same surface, drawing ends
LEAST_LINES = 2  # borders of undrawn parts of one image, where no second image of its size foretells them


def not_drawn(failing: Sequence[Evidence]) -> list[type[Mistake]]:
    """Return the mistake of leaving parts undrawn: whole strips, columns or tiles of one number; none if unproven."""
    found = _blank_values(failing[0]) if failing else None
    if found is None:
        return []
    by_size: dict[tuple[int, int], list[Evidence]] = {}
    for case in failing:
        by_size.setdefault(case.wrong.shape, []).append(case)
    parts: dict[tuple[int, int], np.ndarray] = {}
    cuts, foretold = 0, False
    for (height, width), cases in by_size.items():
        shown = [(case, _holds(case, found)) for case in cases[::2]]
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
    return [undrawn(parts, found, "whole strips or tiles")] if proven else []


def _blank_values(case: Evidence) -> dict[Stage, np.ndarray] | None:
    """Return what most wrong pixels of a case hold, (channels,), at each stage; None where no number is most."""
    found = {}
    for stage in case.stages:
        values, count = np.unique(case.images[stage][case.wrong], axis=0, return_counts=True)
        if not len(count) or count.max() < 0.5 * count.sum():
            return None
        found[stage] = values[np.argmax(count)] if stage is not Stage.VISIBILITY else values[np.argmax(count)][:1]
    return found


def _holds(case: Evidence, blank_values: Mapping[Stage, np.ndarray]) -> np.ndarray:
    found = np.ones(case.wrong.shape, dtype=bool)
    for stage, value in blank_values.items():
        if stage in case.images:
            found &= np.all((case.images[stage] == value) | (np.isnan(case.images[stage]) & np.isnan(value)), axis=-1)
    return found


def _grids(height: int, width: int) -> Iterator[np.ndarray]:
    """Yield the number of each pixel's cell, (height, width), for each way to share out an image, coarse ones first."""
    rows, columns = np.indices((height, width))
    strips = {size for size in SIDES if size < height}
    strips |= {size for threads in THREADS for size in (height // threads, -(-height // threads)) if size}
    yield from (rows // size for size in sorted(strips, reverse=True))
    yield from (columns // size for size in sorted((size for size in SIDES if size < width), reverse=True))
    for size in sorted((size for size in SIDES if 4 <= size < max(height, width)), reverse=True):
        yield rows // size * width + columns // size


def _empty_cells(grid: np.ndarray, empty: np.ndarray, wrong: np.ndarray) -> np.ndarray:
    """Return the pixels (height, width) of cells that are wrong somewhere and hold nothing."""
    drawn, seen = np.zeros(int(grid.max()) + 1, dtype=bool), np.zeros(int(grid.max()) + 1, dtype=bool)
    drawn[grid[~empty]], seen[grid[wrong]] = True, True
    return np.asarray((seen & ~drawn)[grid])


def _cuts(case: Evidence, where: np.ndarray) -> int:
    """Return how many pixels are wrong beside a right one, across a border of what is not drawn."""
    truth = case.right.base.truth
    told = truth[Stage.OBJECT][..., 0] >= 0 if Stage.OBJECT in case.images else (truth[Stage.RADIANCE] > 0).any(axis=-1)
    wrong, good = where & case.wrong, ~where & ~case.wrong & told
    pairs = ((np.s_[1:], np.s_[:-1]), (np.s_[:, 1:], np.s_[:, :-1]))
    return sum(int(np.count_nonzero(wrong[a] & good[b]) + np.count_nonzero(wrong[b] & good[a])) for a, b in pairs)


def _lines(where: np.ndarray) -> int:
    """Return at how many rows and columns an undrawn part begins or ends inside of the image."""
    rows, columns = where[1:] != where[:-1], where[:, 1:] != where[:, :-1]
    return int(np.count_nonzero(rows.any(axis=1)) + np.count_nonzero(columns.any(axis=0)))


# Acne, and noise.

DARKENED = 0.98  # of the wrong pixels so many have no light left
SCATTERED = 0.8  # of these so many have a right pixel of the same shape beside them: of a region its rim alone has
LEAST_DARK = 30  # pixels of a case: of a smaller region nearly all is rim
LEAST_CASES = 3  # that look so, or all of fewer
LEAST_NOISY = 0.2  # of the lit pixels
CORRELATED = 0.3  # of neighbours' relative errors: those of a wrong formula are alike


def acne(left: Sequence[Evidence]) -> Finding | None:
    """Return that surfaces shadow themselves, if dark points are scattered over lit surfaces in some cases."""
    told = [case for case in left if _scattered(case)]
    if len(told) < min(LEAST_CASES, len(left)) or not told:
        return None
    sentence = "lets surfaces shadow themselves, so that scattered points of them are dark (shadow acne)"
    return Finding(name="acne", sentence=sentence, items=("LIT-2", "LIT-3", "LIT-4", "LIT-5"), cases=tuple(told))


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
    for one, other in ((np.s_[1:], np.s_[:-1]), (np.s_[:, 1:], np.s_[:, :-1])):
        same = objects[one] == objects[other]
        beside[one] |= same & good[other]
        beside[other] |= same & good[one]
    return bool(np.count_nonzero(dark & beside) >= SCATTERED * count)


def noise(left: Sequence[Evidence]) -> Finding | None:
    """Return that radiance scatters about the right values from pixel to pixel, if it does so in most cases."""
    told = [case for case in left if _noisy(case)]
    if not told or 2 * len(told) < len(left):
        return None
    sentence = "scatters its radiance about the right values from pixel to pixel, as sampling at random does"
    return Finding(name="noise", sentence=sentence, items=("RAD-5", "CAM-3"), cases=tuple(told))


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
    for one, other in ((np.s_[1:], np.s_[:-1]), (np.s_[:, 1:], np.s_[:, :-1])):
        both = lit[one] & lit[other] & (case.wrong[one] | case.wrong[other]) & (objects[one] == objects[other])
        first, second = off[one][both], off[other][both]
        if len(first) < 100 or first.std() == 0 or second.std() == 0:
            return False
        if not abs(float(np.corrcoef(first, second)[0, 1])) < CORRELATED:
            return False
    mean = float(off[lit & case.wrong].mean())
    return abs(mean) < 0.5 * float(off[lit & case.wrong].std())
