"""Whether an image's values are right but misplaced or damaged: asked before any formula of physics is.

A damage is foretold from the right values and held against every case, as mistakes are. It is done to those stages that
are wrong in some failing case; what is written in its place is right there.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from rayproof.cases.stages import Stage
from rayproof.reports.diagnosis import MISTAKES
from rayproof.reports.diagnosis.hypotheses import Hypothesis
from rayproof.reports.diagnosis.mistakes.image import InSomeStages, Undrawn
from rayproof.reports.diagnosis.trial import ALLOWED, Evidence, deviates

# What the camera's formulas tell of an image in which every stage is written so: then these are named, with both items.
FROM_ANOTHER_CORNER = ("stages_mirrored", "stages_upside_down", "stages_turned_half")
UNDRAWN = "undrawn"
# A name, and those of the camera's mistakes whose images differ from it in the outermost row or column alone.
RIVALS = {"one_place_off": ("one_pixel_right", "one_pixel_left", "one_pixel_down", "one_pixel_up")}
STRIPS = (1, 2, 4, 8, 16, 32, 64)  # pixels: heights of strips, widths of columns, sides of tiles
THREADS = range(2, 33)  # among so many an image is shared out in strips
LEAST_CUTS = 30  # pixels beside which, on one and the same surface, drawing ends
LEAST_LINES = 2  # borders of undrawn parts of one image, where no second image of its size foretells them


def damages(failing: Sequence[Evidence]) -> list[Hypothesis]:
    """Return every way in which images that are right may have been written, done to the stages that are wrong."""
    wrong = _wrong_stages(failing)
    written = set(failing[0].stages) if failing else set()
    found = []
    for name in MISTAKES:
        if MISTAKES[name].ways[0].stored is None or not wrong or (name in FROM_ANOTHER_CORNER and wrong == written):
            continue
        for way in MISTAKES[name].ways:
            stored = _undrawn(failing, wrong) if name == UNDRAWN else way.stored
            if stored is not None:
                there = replace(way, stored=InSomeStages(stored=stored, stages=frozenset(wrong)))
                found.append(Hypothesis(mistakes=(name,), parameters={}, way=there))
    return found


def rivals(found: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Return the camera's mistakes that may look like a damage that was found."""
    names = dict.fromkeys(rival for one in found for name in one.mistakes for rival in RIVALS.get(name, ()))
    return [Hypothesis(mistakes=(name,), parameters={}, way=way) for name in names for way in MISTAKES[name].ways]


def _wrong_stages(failing: Sequence[Evidence]) -> set[Stage]:
    """Return the stages that are wrong in more pixels than may be, in some case."""
    found: set[Stage] = set()
    for case in failing:
        for stage in case.stages:
            if stage not in found:
                off = deviates(case.right, {stage: case.ours[stage]}) & ~case.right.edge
                found |= {stage} if np.count_nonzero(off) > ALLOWED * off.size else set()
    return found


def _undrawn(failing: Sequence[Evidence], stages: set[Stage]) -> Undrawn | None:
    """Return which parts of each size of image are not drawn, by every other case of it; None where none is proven.

    An undrawn part is whole strips, columns or tiles of one number, that end amid surfaces which go on.
    """
    blank = _blank(failing[0], stages)
    if blank is None:
        return None
    by_size: dict[tuple[int, int], list[Evidence]] = {}
    for case in failing:
        by_size.setdefault(case.right.edge.shape, []).append(case)
    parts: dict[tuple[int, int], np.ndarray] = {}
    cuts, foretold = 0, False
    for (height, width), cases in by_size.items():
        shown = [(case, _holds(case, blank)) for case in cases[::2]]
        for grid in _grids(height, width):
            where = np.zeros((height, width), dtype=bool)
            for case, empty in shown:
                where |= _empty_cells(grid, empty, case.wrong)
            if all(np.count_nonzero(case.wrong & ~where) <= ALLOWED * case.wrong.size for case, _ in shown):
                parts[height, width] = where
                cuts += sum(_cuts(case, where) for case, _ in shown)
                foretold |= len(cases) > 1 or _lines(where) >= LEAST_LINES
                break
    return Undrawn(parts=parts, blank=blank) if cuts >= LEAST_CUTS and foretold else None


def _blank(case: Evidence, stages: set[Stage]) -> dict[Stage, np.ndarray] | None:
    """Return what most wrong pixels of a case hold, (channels,), for each stage; None where no number is most."""
    found = {}
    for stage in stages & set(case.stages):
        values, count = np.unique(case.ours[stage][case.wrong], axis=0, return_counts=True)
        if not len(count) or count.max() < 0.5 * count.sum():
            return None
        found[stage] = values[np.argmax(count)]
    return found


def _holds(case: Evidence, blank: dict[Stage, np.ndarray]) -> np.ndarray:
    """Return the pixels (height, width) that hold what the memory held, in every stage."""
    found = np.ones(case.wrong.shape, dtype=bool)
    for stage, value in blank.items():
        if stage in case.stages:
            image = case.ours[stage]
            found &= np.all((image == value) | (np.isnan(image) & np.isnan(value)), axis=-1)
    return found


def _grids(height: int, width: int) -> Iterator[np.ndarray]:
    """Yield the number of each pixel's cell, (height, width), for each way to share out an image, coarse ones first."""
    rows, columns = np.indices((height, width))
    strips = {size for size in STRIPS if size < height}
    strips |= {size for threads in THREADS for size in (height // threads, -(-height // threads)) if size}
    for size in sorted(strips, reverse=True):
        yield rows // size
    for size in sorted((size for size in STRIPS if size < width), reverse=True):
        yield columns // size
    for size in sorted((size for size in STRIPS if 4 <= size < max(height, width)), reverse=True):
        yield rows // size * width + columns // size


def _empty_cells(grid: np.ndarray, empty: np.ndarray, wrong: np.ndarray) -> np.ndarray:
    """Return the pixels (height, width) of cells that are wrong somewhere and hold nothing."""
    drawn = np.zeros(int(grid.max()) + 1, dtype=bool)
    drawn[grid[~empty]] = True
    seen = np.zeros(len(drawn), dtype=bool)
    seen[grid[wrong]] = True
    chosen: np.ndarray = (seen & ~drawn)[grid]
    return chosen


def _cuts(case: Evidence, where: np.ndarray) -> int:
    """Return how many pixels are wrong beside a right one, across a border of what is not drawn, on one surface."""
    plain = ~case.right.edge
    wrong, good = where & case.wrong & plain, ~where & ~case.wrong & plain & _tells(case)
    down = np.count_nonzero(wrong[1:] & good[:-1]) + np.count_nonzero(wrong[:-1] & good[1:])
    along = np.count_nonzero(wrong[:, 1:] & good[:, :-1]) + np.count_nonzero(wrong[:, :-1] & good[:, 1:])
    return int(down + along)


def _tells(case: Evidence) -> np.ndarray:
    """Return the pixels (height, width) of surfaces that are lit, or that any stage before light tells of."""
    if Stage.OBJECT in case.stages or Stage.RADIANCE not in case.right.answers:
        return np.asarray(case.right.answers[Stage.OBJECT])[..., 0] >= 0
    return np.any(np.asarray(case.right.answers[Stage.RADIANCE]) > 0, axis=-1)


def _lines(where: np.ndarray) -> int:
    """Return at how many rows and columns an undrawn part begins or ends inside of the image."""
    return int(
        np.count_nonzero(np.any(where[1:] != where[:-1], axis=1))
        + np.count_nonzero(np.any(where[:, 1:] != where[:, :-1], axis=0))
    )
