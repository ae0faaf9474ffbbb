"""`Question`, `ExactAnswers` and `Grades`: the evaluation of a formula on a ladder's inputs, and its grading.

Contract of a question, registered under the name that ladders use:

    truth(ladder, inputs, rungs)                  -> `ExactAnswers`, the same for every formula
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
PER_VALUE = 4  # rays per value of a sweep that a second arithmetic checks


@dataclass(frozen=True)
class Witness:
    """The check of the truth by a second arithmetic: number of values, and largest relative distance from the truth."""

    values: int
    worst: float


@dataclass(frozen=True, kw_only=True)
class ExactAnswers:
    """The results of exact mathematics on the floats that the formula receives."""

    counted: np.ndarray  # (rays,) bool: False for a ray without an exact answer, such as a tie that is left out
    facts: Mapping[str, Any]
    witness: Witness


@dataclass(frozen=True, kw_only=True)
class Grades:
    """The grades of one formula, (rays,). The error is NaN if there is nothing to measure."""

    counted: np.ndarray
    false_hit: np.ndarray
    false_miss: np.ndarray
    invalid: np.ndarray  # NaN, or no answer at all
    error: np.ndarray  # in the ladder's unit
    index: np.ndarray  # error / (K u)
    counts: Mapping[str, np.ndarray] = field(default_factory=dict)  # additional counts, by name


class Question(Protocol):
    """A question of the registry `QUESTIONS`; see the package's docstring."""

    def truth(self, ladder: Ladder, inputs: Inputs, rungs: np.ndarray) -> ExactAnswers:
        """Return the exact answers for all rays."""
        ...

    def answer(self, ladder: Ladder, formula: Formula, inputs: Inputs, precision: str) -> Answer:
        """Return the answers of a formula for all rays."""
        ...

    def grade(self, ladder: Ladder, inputs: Inputs, truth: ExactAnswers, answer: Answer, precision: str) -> Grades:
        """Return the grades of the answers."""
        ...


QUESTIONS: Registry[type[Question]] = Registry("question", package="rayproof.reports.studies.stability.questions")


def nothing(rays: int) -> np.ndarray:
    """Return a mask (rays,) of False."""
    return np.zeros(rays, dtype=bool)


def sample(rungs: np.ndarray, per_value: int = PER_VALUE) -> np.ndarray:
    """Return the indices of the first `per_value` rays of every value."""
    return np.concatenate([np.flatnonzero(rungs == rung)[:per_value] for rung in np.unique(rungs)])
