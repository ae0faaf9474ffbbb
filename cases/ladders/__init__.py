"""`Ladder`, a sweep of a formula's inputs from easy to ill-conditioned: gate, predicted slope, expected failures.

To add one: a `Ladder` in the list `LADDERS` of its group's module, together with a seeded draw of its inputs; a new
module must be named in PAGES. `reports.studies.stability` measures the results of formulas for these inputs.
"""

import importlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from rayproof.cases.placement import unit

Inputs = dict[str, np.ndarray]  # float64 arrays of numbers that the working precision has, (rays,) or (rays, 3)
Draw = Callable[[float, int, np.random.Generator, str], Inputs]  # parameter, rays, generator, precision
Formulas = tuple[str, ...]  # variants, or "slot/variant" where slots share a name, or "*" for all others
BOTH = ("float32", "float64")
DTYPES = {"float32": np.float32, "float64": np.float64}
# The order of the list of ladders.
PAGES = (
    "boxes",
    "camera",
    "camera_matrices",
    "light",
    "shadows",
    "spheres",
    "flat_shapes",
    "transforms",
    "triangles",
    "values",
    "watertight",
)


@dataclass(frozen=True, kw_only=True)
class PredictedSlope:
    """The predicted slope of the median error, in the ladder's unit, in a log-log plot against the parameter."""

    formulas: Formulas
    slope: float
    because: str
    precisions: tuple[str, ...] = BOTH
    within: float = 0.15
    skip: int = 0  # first values of the sweep, at which a constant still hides the slope


@dataclass(frozen=True, kw_only=True)
class Gate:
    """The required range of a formula: its first failing value must not come before `reaches`, a value of the sweep."""

    reaches: Mapping[str, float]  # per precision
    misclassified: float = 1e-3  # largest share of rays, of false hits and false misses together
    index: float = 4.0  # largest error / (K u); inf if K does not apply
    faultless: Formulas = ()  # variants that may not answer a single ray wrongly


@dataclass(frozen=True, kw_only=True)
class Failure:
    """Formulas that are expected to fail the gate, and the reason. A formula that passes all the same is a surprise."""

    formulas: Formulas
    because: str
    precisions: tuple[str, ...] = BOTH


@dataclass(frozen=True, kw_only=True)
class Ladder:
    """One sweep of the catalogue. Values run from easy to hard; the inputs are drawn with the ladder's own seed.

    `question` names the module that computes the exact values and calls a formula
    (`reports.studies.stability.questions`); `condition` is the condition number K as the question defines it, `unit`
    the divisor of an error.
    """

    name: str
    group: str
    question: str
    slots: tuple[str, ...]
    parameter: str  # the swept quantity, and its unit
    values: tuple[float, ...]
    draw: Draw
    unit: str  # of the error, for the reader
    condition: str  # K, for the reader
    gate: Gate
    first_to_break: str
    survivor: str
    slopes: tuple[PredictedSlope, ...] = ()
    fails: tuple[Failure, ...] = ()
    rays: int = 1000  # per value
    quick_rays: int = 200
    saturated: float = 0.3  # values with at least this median error are left out of the slope
    options: Mapping[str, object] = field(default_factory=dict)  # for the question
    only: Formulas = ()  # variants that the question makes sense for; empty: all
    measured: str = ""  # the measured behaviour and its reason, if the design predicted another
    kind: Literal["sweep", "count", "values"] = "sweep"

    def __post_init__(self) -> None:
        missing = [value for value in self.gate.reaches.values() if value not in self.values]
        if missing:
            raise ValueError(f"ladder {self.name}: the gate reaches {missing[0]}, which is none of {self.values}")

    @property
    def seed(self) -> int:
        """Return the seed of the ladder's inputs: its name."""
        return int.from_bytes(self.name.encode()) % 2**63

    def predicted(self, formula: str, precision: str) -> PredictedSlope | None:
        """Return the slope that is predicted for "slot/variant", or None."""
        return next(
            (slope for slope in self.slopes if precision in slope.precisions and _named(slope.formulas, formula)), None
        )

    def failure(self, formula: str, precision: str) -> Failure | None:
        """Return the expected failure of the formula "slot/variant", or None."""
        return next(
            (
                failure
                for failure in self.fails
                if precision in failure.precisions and _named(failure.formulas, formula)
            ),
            None,
        )


def _named(formulas: Formulas, formula: str) -> bool:
    return formula in formulas or formula.rpartition("/")[2] in formulas or "*" in formulas


# Common to all seeded draws of inputs: numbers of the working precision.


def rounded(values: np.ndarray, precision: str) -> np.ndarray:
    """Return `values` rounded to the working precision, as float64. An overflow gives an infinity."""
    with np.errstate(over="ignore"):
        return np.asarray(values).astype(DTYPES[precision]).astype(np.float64)


def directions(count: int, generator: np.random.Generator) -> np.ndarray:
    """Return unit vectors in random directions, (count, 3). No rotation is a special one: axes hide rounding errors."""
    return unit(generator.normal(size=(count, 3)))


def across(vectors: np.ndarray, generator: np.random.Generator) -> np.ndarray:
    """Return random unit vectors at right angles to unit `vectors`."""
    return unit(np.cross(vectors, directions(len(vectors), generator)))


def rotation(generator: np.random.Generator) -> np.ndarray:
    """Return a random rotation matrix (3, 3)."""
    q, r = np.linalg.qr(generator.normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return q * np.sign(np.linalg.det(q))


def all_ladders() -> tuple[Ladder, ...]:
    """Return every ladder of every page, in the order of PAGES and of their lists.

    Raises:
        ValueError: two ladders share a name.

    """
    ladders: dict[str, Ladder] = {}
    for page in PAGES:
        for ladder in importlib.import_module(f"{__name__}.{page}").LADDERS:
            if ladder.name in ladders:
                raise ValueError(f"two ladders are called {ladder.name}")
            ladders[ladder.name] = ladder
    return tuple(ladders.values())
