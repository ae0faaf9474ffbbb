"""A ladder: a sweep from easy to ill-conditioned, and what is predicted to happen on the way up."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

Inputs = dict[str, np.ndarray]  # float64 arrays of numbers that the working precision has, (rays,) or (rays, 3)
Draw = Callable[[float, int, np.random.Generator, str], Inputs]  # parameter, rays, generator, precision
Formulas = tuple[str, ...]  # variants, or "slot/variant" where slots share a name, or "*" for all others
BOTH = ("float32", "float64")


@dataclass(frozen=True, kw_only=True)
class Law:
    """The predicted slope of the median error, in the ladder's unit, in a log-log plot against the parameter."""

    formulas: Formulas
    slope: float
    because: str
    precisions: tuple[str, ...] = BOTH
    within: float = 0.15
    skip: int = 0  # first values of the sweep, at which a constant still hides the law


@dataclass(frozen=True, kw_only=True)
class Gate:
    """How far a formula must climb: the breakpoint may not lie before `reaches`, a value of the sweep."""

    reaches: Mapping[str, float]  # per precision
    misclassified: float = 1e-3  # largest share of rays, of false hits and false misses together
    index: float = 4.0  # largest error / (K u); inf where K does not judge
    faultless: Formulas = ()  # variants that may not answer a single ray wrongly


@dataclass(frozen=True, kw_only=True)
class Failure:
    """Formulas that are expected to fail the gate, and why. One that passes all the same is a surprise."""

    formulas: Formulas
    because: str
    precisions: tuple[str, ...] = BOTH


@dataclass(frozen=True, kw_only=True)
class Ladder:
    """One sweep of the catalogue. Values run from easy to hard; the inputs are drawn with a seed of the ladder's own.

    `question` names how truth is found and a formula is asked (`reports.studies.stability.questions`); `condition` is K
    as the question understands it, `unit` what an error is divided by.
    """

    name: str
    group: str
    question: str
    slots: tuple[str, ...]
    parameter: str  # what is swept, and its unit
    values: tuple[float, ...]
    draw: Draw
    unit: str  # of the error, for the reader
    condition: str  # K, for the reader
    gate: Gate
    first_to_break: str
    survivor: str
    laws: tuple[Law, ...] = ()
    fails: tuple[Failure, ...] = ()
    rays: int = 1000  # per value
    quick_rays: int = 200
    saturated: float = 0.3  # median error from which on a value says nothing about the slope
    options: Mapping[str, object] = field(default_factory=dict)  # for the question
    only: Formulas = ()  # variants that the question makes sense for; empty: all
    measured: str = ""  # where the design predicted otherwise, what was measured and why
    kind: Literal["sweep", "count", "values"] = "sweep"

    def __post_init__(self) -> None:
        missing = [value for value in self.gate.reaches.values() if value not in self.values]
        if missing:
            raise ValueError(f"ladder {self.name}: the gate reaches {missing[0]}, which is none of {self.values}")

    @property
    def seed(self) -> int:
        """Return the seed of the ladder's inputs: its name."""
        return int.from_bytes(self.name.encode()) % 2**63

    def law(self, formula: str, precision: str) -> Law | None:
        """Return the law that is predicted for "slot/variant", or None."""
        return next((law for law in self.laws if precision in law.precisions and _named(law.formulas, formula)), None)

    def failure(self, formula: str, precision: str) -> Failure | None:
        """Return why "slot/variant" is expected to fail, or None."""
        return next((one for one in self.fails if precision in one.precisions and _named(one.formulas, formula)), None)


def _named(formulas: Formulas, formula: str) -> bool:
    return formula in formulas or formula.rpartition("/")[2] in formulas or "*" in formulas
