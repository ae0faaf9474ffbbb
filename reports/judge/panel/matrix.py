"""Everybody against everybody: for each stage, every party judged against every other as the baseline.

Whose interior and whose limits is always the oracle's ground; whom a row is compared with is its column. What the
checks have measured already is taken from them.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rayproof.cases.stages import Stage
from rayproof.reports.judge.comparison.check import Check, camera_check
from rayproof.reports.judge.comparison.measurement import jsonable, ratios
from rayproof.reports.judge.comparison.pair import Bench
from rayproof.reports.judge.renderers import Candidate, Witness, as_candidate, as_witness
from rayproof.reports.judge.tolerance.output_resolution import WHOLE
from rayproof.reports.judge.tolerance.scene_context import Ground
from rayproof.reports.results.records import AdjudicationRecord

SHOWN = 4  # digits of a ratio in a table that people read; checks have them all


@dataclass(frozen=True, kw_only=True)
class Cell:
    """One party judged against another."""

    ratio: float  # worst error over limit; edge pixels only if their value is neither side's
    differing: int  # interior pixels over the limit; of the camera, which has none, 1 if it is over

    @property
    def agrees(self) -> bool:
        """Say whether the row is within every limit of its column."""
        return self.ratio <= 1


@dataclass(frozen=True, kw_only=True)
class Matrix:
    """One stage: `cells[row, column]` by names; what cannot be compared, and each with itself, is not there."""

    stage: Stage
    renderers: tuple[str, ...]
    cells: Mapping[tuple[str, str], Cell]

    def agree(self, one: str, other: str) -> bool | None:
        """Say whether two parties agree, either way round; None where they cannot be compared."""
        both = [self.cells[pair] for pair in ((one, other), (other, one)) if pair in self.cells]
        return all(cell.agrees for cell in both) if both else None

    def answered(self) -> tuple[str, ...]:
        """Return who can be compared with anybody here."""
        return tuple(name for name in self.renderers if any(name in pair for pair in self.cells))

    def as_json(self) -> AdjudicationRecord:
        """Return plain JSON data: rows are judged, columns are their baselines."""

        def table(value: Callable[[Cell], float | int]) -> list[list[Any]]:
            return [
                [jsonable(value(self.cells[row, column])) if (row, column) in self.cells else None for column in names]
                for row in names
            ]

        names = self.renderers
        return {
            "renderers": list(names),
            "ratio": table(lambda cell: float(f"{cell.ratio:.{SHOWN}g}")),
            "differing": table(lambda cell: cell.differing),
        }


def matrices(
    ground: Ground,
    candidates: Sequence[Candidate],
    witnesses: Sequence[Witness],
    stages: Sequence[Stage],
    checks: Sequence[Check],
) -> dict[Stage, Matrix]:
    """Return each stage's matrix over all parties; a stage of the wrong size must have been taken from its party."""
    tested = [(candidate, as_witness(candidate)) for candidate in candidates]
    parties = [*tested, *((as_candidate(witness), witness) for witness in witnesses)]
    known = {
        (check.configuration, check.reference, check.stage): check for check in checks if check.end_to_end is not None
    }
    names = tuple(candidate.name for candidate, _ in parties)
    cells: dict[Stage, dict[tuple[str, str], Cell]] = {stage: {} for stage in stages}
    able = [{stage for stage in stages if _answers(ground, mine, stage)} for mine, _ in parties]
    for index, (mine, i_am) in enumerate(parties):
        for other, (theirs, they_are) in enumerate(parties[index + 1 :], start=index + 1):
            here = Bench(ground=ground, candidate=mine, witness=they_are)
            there = Bench(ground=ground, candidate=theirs, witness=i_am)
            for stage in (stage for stage in stages if stage in able[index] and stage in able[other]):
                check = known.get((mine.name, theirs.name, stage))
                forth, home = _cells(here, there, stage, check)
                cells[stage][mine.name, theirs.name] = forth
                cells[stage][theirs.name, mine.name] = home
    return {stage: Matrix(stage=stage, renderers=names, cells=found) for stage, found in cells.items()}


def _answers(ground: Ground, party: Candidate, stage: Stage) -> bool:
    """Say whether a party answers a stage, in the scene's size."""
    image = (party.answers or {}).get(stage)
    if image is None or stage in party.unsupported:
        return False
    return stage is Stage.CAMERA or (np.ndim(image) == 3 and np.shape(image)[:2] == ground.conditioning.hit.shape)


def _cells(here: Bench, there: Bench, stage: Stage, check: Check | None) -> tuple[Cell, Cell]:
    """Return the cell of `here` and that of `there`, which is the same pair the other way round."""
    if stage is Stage.CAMERA:
        ratio = camera_check(here).ratio
        cell = Cell(ratio=ratio, differing=int(not ratio <= 1))
        return cell, cell
    if check is None or check.end_to_end is None:
        within = _within(here, stage)
        if within is not None:
            return within, within
    measured = check.end_to_end if check is not None and check.end_to_end is not None else here.end_to_end(stage)
    cell = Cell(ratio=measured.worst_ratio, differing=measured.over_inside)
    # Only at edges does it matter who is judged: there the judged one must have a side's value.
    if not measured.differ_at_edge:
        return cell, cell
    back = there.end_to_end(stage)
    return cell, Cell(ratio=back.worst_ratio, differing=back.over_inside)


def _within(bench: Bench, stage: Stage) -> Cell | None:
    """Return the cell of two who agree everywhere, edges or not; None if they differ anywhere."""
    assert bench.candidate.answers is not None
    ours, theirs = bench.candidate.answers[stage], bench.witness.answers[stage]
    if ours is theirs:
        return Cell(ratio=0.0, differing=0)
    if stage in WHOLE:
        return Cell(ratio=0.0, differing=0) if np.array_equal(ours, theirs) else None
    worst = bench.ground.once(
        ("within", stage, bench.terms.rounding, *bench.authors(stage)), lambda: _worst(bench, stage, ours, theirs)
    )
    return Cell(ratio=worst, differing=0) if worst <= 1 else None


def _worst(bench: Bench, stage: Stage, ours: np.ndarray, theirs: np.ndarray) -> float:
    """Return the worst error over limit in the whole image."""
    found = ratios(stage, ours, theirs, bench.terms.limits.end_to_end[stage])[0]
    return float(found.max())
