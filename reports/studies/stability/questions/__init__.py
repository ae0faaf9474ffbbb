"""`Question`, `Truth` and `Grades`: how a formula is asked about a ladder's inputs and graded.

Contract of a question, registered under the name that ladders use:

    truth(ladder, inputs, rungs)                  -> `Truth`, the same for every formula
    answer(ladder, formula, inputs, precision)    -> dict of float64 arrays, one kernel for all inputs where possible
    grade(ladder, inputs, truth, answer, precision) -> `Grades`, one entry per ray
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from rayproof.cases.ladders import Inputs, Ladder
from rayproof.cases.registry import Registry
from rayproof.tracer.formulas import Formula

Answer = dict[str, np.ndarray]
PER_VALUE = 4  # rays of every value of a sweep that the witness sees


@dataclass(frozen=True)
class Witness:
    """What the second arithmetic said of a sample: values seen, and the largest relative distance from the truth."""

    values: int
    worst: float


@dataclass(frozen=True, kw_only=True)
class Truth:
    """Exact mathematics on the floats that the formula receives."""

    counted: np.ndarray  # (rays,) False where the question has no answer (a tie that the ladder does not ask about)
    facts: Mapping[str, Any]
    witness: Witness


@dataclass(frozen=True, kw_only=True)
class Grades:
    """One formula's marks, (rays,). An error is NaN where there is nothing to measure."""

    counted: np.ndarray
    false_hit: np.ndarray
    false_miss: np.ndarray
    invalid: np.ndarray  # NaN, or otherwise no answer at all
    error: np.ndarray  # in the ladder's unit
    index: np.ndarray  # error / (K u)
    counts: Mapping[str, np.ndarray] = field(default_factory=dict)  # what else is counted, by name


class Question(Protocol):
    """What `QUESTIONS` holds; see the package's docstring."""

    def truth(self, ladder: Ladder, inputs: Inputs, rungs: np.ndarray) -> Truth:
        """Return the truth about all rays."""
        ...

    def answer(self, ladder: Ladder, formula: Formula, inputs: Inputs, precision: str) -> Answer:
        """Return what a formula answers."""
        ...

    def grade(self, ladder: Ladder, inputs: Inputs, truth: Truth, answer: Answer, precision: str) -> Grades:
        """Return its marks."""
        ...


QUESTIONS: Registry[type[Question]] = Registry("question", package="rayproof.reports.studies.stability.questions")


def nothing(rays: int) -> np.ndarray:
    """Return (rays,) False."""
    return np.zeros(rays, dtype=bool)


def sample(rungs: np.ndarray, per_value: int = PER_VALUE) -> np.ndarray:
    """Return the indices of the first rays of every value."""
    return np.concatenate([np.flatnonzero(rungs == rung)[:per_value] for rung in np.unique(rungs)])
