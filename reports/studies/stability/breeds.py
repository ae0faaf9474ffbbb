"""Inputs bred by evolution from a ladder's inputs, for slots that intersect no shape.

A genome chooses two of the ladder's rays as parents, the parent of each input, and a change of one component of each
input: by a few roundings, to zero, to its neighbour's value, or by a power of two. Every number stays within the range
that the ladder draws up to its gate, where a formula must be right. Unit vectors stay unit vectors.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rayproof.cases.ladders import DTYPES, Inputs, Ladder, all_ladders, rounded
from rayproof.cases.placement import unit
from rayproof.cases.rounding import UNIT_ROUNDOFF
from rayproof.reference.certified.columns import parts
from rayproof.reports.judge.forward.limits import HIT
from rayproof.reports.studies.stability.questions import QUESTIONS
from rayproof.reports.studies.stability.questions.light import ASKED as DECISIONS
from rayproof.reports.studies.stability.shapes import Conditioned
from rayproof.tracer.formulas import FORMULAS, Formula
from rayproof.tracer.formulas.own_file import is_own

# Questions whose answers are numbers with an error over K u, and decisions whose clearance is a number of roundings.
NUMBERS = ("value", "light", "view_ray", "point", "sphere_normal", "placed_normal", "placed_distance")
SIGNS = ("decision", "facing")
FIXED = ("fovy", "aspect")  # of a camera: unchanged, because a kernel computes many rays of the same pair
RAYS, BETWEEN = 48, 6  # rays drawn per value, and additional values between two steps of the ladder
ULPS = 64  # largest change by roundings
UNIT = 1e-5  # largest error of a unit vector's length in float32, roundings of its components included
GENES = 4  # per input: the parent, the kind of change, the component, the amount
POPULATION = {"placed_normal": 128, "placed_distance": 64}  # smaller for questions whose truth needs balls of many bits
USUAL_POPULATION = 1024
LOST = 2.0**20  # limits: the score of an answer that is no number
EXACT = 2.0**-53  # K u: the limit of a ladder that allows no error, so that any error is far above it


def ladders_of(formula: Formula, precision: str) -> list[Ladder]:
    """Return the ladders whose inputs the search for a formula's worst inputs starts from.

    These ladders ask for numbers or for decisions of its slot, and the slot's default passes them.
    """
    default = FORMULAS.slots[formula.slot]
    variant = default if is_own(formula.variant) or formula.kind == "fault" else formula.variant
    return [
        ladder
        for ladder in all_ladders()
        if formula.slot in ladder.slots
        and ladder.question in (*NUMBERS, *SIGNS)
        and (ladder.question != "value" or ladder.slots[0] == formula.slot)
        and (ladder.question in SIGNS or np.isfinite(ladder.gate.index))
        and (not ladder.only or variant in ladder.only)
        and ladder.failure(f"{formula.slot}/{default}", precision) is None
    ]


@dataclass(frozen=True, kw_only=True)
class LadderBreed:
    """Inputs bred from the inputs of a ladder, for one formula in one precision."""

    ladder: Ladder
    formula: Formula
    precision: str
    seed: int

    @cached_property
    def pool(self) -> Inputs:
        """Return the inputs that the ladder draws at its values and between them, up to the gate, sorted by value."""
        generator = np.random.default_rng([self.seed, self.ladder.seed])
        last = self.ladder.values.index(self.ladder.gate.reaches[self.precision])
        rungs = np.array(self.ladder.values[: last + 1])
        values = rungs
        if self.ladder.kind == "sweep" and np.all(rungs > 0) and len(rungs) > 1:
            places = np.linspace(0, len(rungs) - 1, (len(rungs) - 1) * (BETWEEN + 1) + 1)
            values = np.exp(np.interp(places, np.arange(len(rungs)), np.log(rungs)))
        drawn = [self.ladder.draw(float(value), RAYS, generator, self.precision) for value in values]
        return {name: np.concatenate([inputs[name] for inputs in drawn]) for name in drawn[0]}

    @property
    def population(self) -> int:
        """Return the number of genomes that are judged at a time."""
        return POPULATION.get(self.ladder.question, USUAL_POPULATION)

    @property
    def genes(self) -> int:
        """Return the number of genes per genome."""
        return 2 + GENES * len(self.pool)

    def decoded(self, genomes: np.ndarray) -> Inputs:
        """Return the inputs of genomes (genes, rays)."""
        genomes = np.clip(genomes, 0.0, 1.0)
        rows = len(next(iter(self.pool.values())))
        first, second = (np.minimum((gene * rows).astype(int), rows - 1) for gene in genomes[:2])
        inputs: Inputs = {}
        for place, (name, drawn) in enumerate(self.pool.items()):
            parent, change, component, amount = genomes[2 + GENES * place : 2 + GENES * (place + 1)]
            bred = first if name in FIXED else np.where(parent < 0.7, first, second)
            table = drawn.reshape(rows, -1)
            columns = table[bred] if name in FIXED else self._changed(bred, table, change, component, amount)
            if table.shape[1] == 3 and np.all(abs(np.linalg.norm(table, axis=1) - 1) < UNIT):
                columns = rounded(unit(columns), self.precision)
            inputs[name] = columns.reshape(len(bred), *drawn.shape[1:])
        return inputs

    def _changed(
        self, bred: np.ndarray, table: np.ndarray, change: np.ndarray, component: np.ndarray, amount: np.ndarray
    ) -> np.ndarray:
        """Return inputs (rays, components) with one component changed, within the range that the ladder draws."""
        columns = table[bred]
        rays, width = np.arange(len(columns)), columns.shape[1]
        chosen = np.minimum((component * width).astype(int), width - 1)
        value, step = columns[rays, chosen], np.round((2 * amount - 1) * ULPS)
        with np.errstate(over="ignore", invalid="ignore"):
            ulps = value + step * np.spacing(value.astype(DTYPES[self.precision])).astype(np.float64)
            power = np.ldexp(value, np.round(8 * amount - 4).astype(int))
        neighbour = columns[rays, (chosen + 1) % width]
        changed = np.select(
            [change < 0.4, change < 0.7, change < 0.75, change < 0.85], [value, ulps, 0.0, neighbour], power
        )
        low, high = table.min(axis=0)[chosen], table.max(axis=0)[chosen]
        columns[rays, chosen] = np.clip(rounded(changed, self.precision), low, high)
        # Keep the lengths of vectors within the ladder's range, too, so that their squares do not over- or underflow.
        lengths, own = np.linalg.norm(table, axis=1), np.linalg.norm(columns, axis=1)
        with np.errstate(all="ignore"):
            return np.where(((own < lengths.min()) | (own > lengths.max()))[:, None], table[bred], columns)

    def judged(self, inputs: Inputs) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the score of each ray, its kind, and whether it is an exact tie that the formula decides wrongly."""
        question = QUESTIONS[self.ladder.question]()
        rays = len(next(iter(inputs.values())))
        truth = question.truth(self.ladder, inputs, np.zeros(rays, dtype=int))
        answer = question.answer(self.ladder, self.formula, inputs, self.precision)
        grades = question.grade(self.ladder, inputs, truth, answer, self.precision)
        wrong = grades.counted & (grades.false_hit | grades.false_miss) & (self.ladder.question in SIGNS)
        if self.ladder.question in SIGNS:
            clear = self._clearance(inputs)
            scores = np.where(wrong, clear / HIT, 0.0)  # HIT roundings of every input explain either decision
        else:
            clear = np.full(rays, np.inf)
            with np.errstate(all="ignore"):
                limit = self.ladder.gate.index or EXACT
                scores = np.nan_to_num(grades.index, nan=0.0, posinf=LOST) / limit
            scores = np.minimum(np.where(grades.invalid, LOST, scores), LOST)
        kinds = np.where(grades.invalid, "no number", np.where(wrong, "wrong decision", "error"))
        return np.where(grades.counted & np.isfinite(scores), scores, 0.0), kinds, wrong & (clear == 0)

    def _clearance(self, inputs: Inputs) -> np.ndarray:
        """Return the least distance from zero of the deciding numbers, in roundings of every input."""
        with np.errstate(all="ignore"):
            decision = DECISIONS.get(self.formula.slot, DECISIONS["hidden"])  # `facing` has the predicate of `hidden`
            predicates = decision.predicates(parts(inputs, Conditioned))
            clearances = [
                abs(value.value) / (value.weight * UNIT_ROUNDOFF[self.precision]) for value in predicates.values()
            ]
        return np.min([np.where(np.isnan(value), np.inf, value) for value in clearances], axis=0)
