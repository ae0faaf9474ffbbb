"""What is a formula's number, or its numbers, worth? For slots that return neither a hit nor a decision.

One entry of `ASKED` a slot: the exact mathematics, and how the formula is asked. K is what the very expression makes
of one rounding of each input (`reports.studies.stability.conditioned`). A ray's error is that of its worst number.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import product
from types import SimpleNamespace
from typing import Any

import numpy as np
from flint import arb

from rayproof.cases.ladders import Inputs, Ladder
from rayproof.cases.rounding import UNIT_ROUNDOFF
from rayproof.reports.studies.stability.bounded_pairs import Pair
from rayproof.reports.studies.stability.conditioned import Conditioned
from rayproof.reports.studies.stability.device import downloaded, uploaded
from rayproof.reports.studies.stability.exactly import Columns, Mathematics, evaluated, parts, sample, witnessed
from rayproof.reports.studies.stability.mathematics import dot, plus, times
from rayproof.reports.studies.stability.questions import QUESTIONS, Answer, Grades, Truth, Witness, nothing
from rayproof.tracer.formulas import Formula
from rayproof.tracer.formulas.camera import ORDER
from rayproof.tracer.kernel.arithmetic import matrix
from rayproof.tracer.kernel.arrays import array_types

PI_REST = 1.2246467991473532e-16  # what float64's pi lacks
PLACES = tuple(product(range(4), repeat=2))  # of a 4x4 matrix
Ask = Callable[[Formula, Columns], Mapping[str, Any]]


@dataclass(frozen=True, kw_only=True)
class Asked:
    """One slot: what its numbers truly are, and how a formula is asked for them."""

    exact: Mathematics
    ask: Ask


def named(*names: str) -> Callable[[Any], Columns]:
    """Return what gives several results their names."""
    return lambda results: dict(zip(names, results, strict=True))


def numbered(vectors: Any) -> Columns:
    """Return the components of vectors by their places."""
    return {f"{k}{i}": x for k, vector in enumerate(vectors) for i, x in enumerate(vector)}


def inverted(x: Columns) -> Columns:
    """Return the inverse of the matrix m00 ... m33 by cofactors."""
    m = {(i, j): x[f"m{i}{j}"] for i, j in PLACES}

    def minor(row: int, column: int) -> Any:
        a, b, c = (i for i in range(4) if i != row)
        p, q, r = (j for j in range(4) if j != column)
        return (
            m[a, p] * (m[b, q] * m[c, r] - m[b, r] * m[c, q])
            - m[a, q] * (m[b, p] * m[c, r] - m[b, r] * m[c, p])
            + m[a, r] * (m[b, p] * m[c, q] - m[b, q] * m[c, p])
        )

    cofactors = {(i, j): minor(i, j) if (i + j) % 2 == 0 else -minor(i, j) for i, j in PLACES}
    determinant = sum((m[0, j] * cofactors[0, j] for j in range(1, 4)), m[0, 0] * cofactors[0, 0])
    return {f"{i}{j}": cofactors[j, i] / determinant for i, j in PLACES}


def inverse(formula: Formula, x: Columns) -> Columns:
    """Return what a formula makes of the matrix m00 ... m33."""
    found = formula.function(matrix([[x[f"m{i}{j}"] for j in range(4)] for i in range(4)], like=x["m00"]))
    return {f"{i}{j}": found[i, j] for i, j in PLACES}


def projected(x: Columns) -> Columns:
    """Return the four numbers of a projection that are neither 0 nor 1."""
    stretch = x["far"] / (x["far"] - x["near"])
    return {"00": 1 / x["horizontal"], "11": 1 / x["vertical"], "22": stretch, "23": -(x["near"] * stretch)}


def projection(formula: Formula, x: Columns) -> Columns:
    """Return the same of a formula."""
    found = formula.function(x["horizontal"], x["vertical"], x["near"], x["far"])
    return {f"{i}{j}": found[i, j] for i, j in ((0, 0), (1, 1), (2, 2), (2, 3))}


def view(formula: Formula, x: Columns) -> Columns:
    """Return the translation in a formula's view matrix [m]."""
    found = formula.function(x["eye"], x["right"], x["up"], x["forward"])
    return {f"{i}3": found[i, 3] for i in range(3)}


def cornered(x: Columns) -> Columns:
    """Return the corners of the frustum [m]."""
    found = []
    for depth, (sx, sy) in product((x["near"], x["far"]), ORDER):
        across, upwards = times(x["right"], sx * x["horizontal"]), times(x["up"], sy * x["vertical"])
        found.append(plus(x["eye"], times(plus(plus(x["forward"], across), upwards), depth)))
    return numbered(found)


def lights(x: Columns) -> list[Any]:
    """Return the contributions light0, light1, ..."""
    return [x[f"light{k}"] for k in range(sum(name.startswith("light") for name in x))]


def pi(like: Any) -> Any:
    """Return pi as a number of the same kind; it is rounded as an input is."""
    if isinstance(like, Pair):
        return Pair(np.pi, PI_REST)
    return Conditioned(np.pi) if isinstance(like, Conditioned) else arb.pi()


ASKED: Mapping[str, Asked] = {
    "sample": Asked(
        exact=lambda x: {axis: (2 * x[axis] + 1) / (2 * x["per_side"]) for axis in ("column", "row")},
        ask=lambda formula, x: named("column", "row")(formula.function(x["column"], x["row"], x["per_side"])),
    ),
    "ndc": Asked(
        exact=lambda x: {"sx": 2 * x["px"] / x["width"] - 1, "sy": 1 - 2 * x["py"] / x["height"]},
        ask=lambda formula, x: named("sx", "sy")(formula.function(x["px"], x["py"], x["width"], x["height"])),
    ),
    "pixel": Asked(
        exact=lambda x: {"px": (x["sx"] + 1) * x["width"] / 2, "py": (1 - x["sy"]) * x["height"] / 2},
        ask=lambda formula, x: named("px", "py")(formula.function(x["sx"], x["sy"], x["width"], x["height"])),
    ),
    "projection": Asked(exact=projected, ask=projection),
    "view": Asked(
        exact=lambda x: {f"{i}3": -dot(x[axis], x["eye"]) for i, axis in enumerate(("right", "up", "forward"))},
        ask=view,
    ),
    "inverse": Asked(exact=inverted, ask=inverse),
    "corners": Asked(exact=cornered, ask=lambda formula, x: numbered(formula.function(SimpleNamespace(**x)))),
    "clip_depth": Asked(
        exact=lambda x: {end: x[end] / dot(x["direction"], x["forward"]) for end in ("near", "far")},
        ask=lambda formula, x: named("near", "far")(
            formula.function(x["direction"], x["forward"], x["near"], x["far"])
        ),
    ),
    "sum_lights": Asked(
        exact=lambda x: {"sum": sum(lights(x)[1:], lights(x)[0])},
        ask=lambda formula, x: {"sum": formula.function(lights(x))},
    ),
    "exitance": Asked(
        exact=lambda x: numbered([[a * e for a, e in zip(x["albedo"], x["irradiance"], strict=True)]]),
        ask=lambda formula, x: numbered([formula.function(x["albedo"], x["irradiance"])]),
    ),
    "radiance": Asked(
        exact=lambda x: {"L": x["exitance"] / pi(x["exitance"])},
        ask=lambda formula, x: {"L": formula.function(x["exitance"])},
    ),
    "radiance_simplified": Asked(
        exact=lambda x: {"L": x["exitance"] * 1}, ask=lambda formula, x: {"L": formula.function(x["exitance"])}
    ),
}


@QUESTIONS.register("value")
class Value:
    """The numbers of the ladder's first slot."""

    def truth(self, ladder: Ladder, inputs: Inputs, rungs: np.ndarray) -> Truth:
        """Return the exact numbers and their weights."""
        exact = ASKED[ladder.slots[0]].exact
        found = evaluated(exact, inputs)
        witness = Witness(*witnessed(exact, inputs, found, sample(rungs)))
        with np.errstate(all="ignore"):
            weights = {name: one.weight for name, one in exact(parts(inputs, Conditioned)).items()}
        return Truth(counted=~nothing(len(rungs)), facts={"exact": found, "weights": weights}, witness=witness)

    def answer(self, ladder: Ladder, formula: Formula, inputs: Inputs, precision: str) -> Answer:
        """Return the formula's numbers."""
        found = ASKED[ladder.slots[0]].ask(formula, uploaded(inputs, array_types(precision)))
        return downloaded(found, len(next(iter(inputs.values()))))

    def grade(self, ladder: Ladder, inputs: Inputs, truth: Truth, answer: Answer, precision: str) -> Grades:
        """Return errors in the ladder's unit."""
        exact, weights, u = truth.facts["exact"], truth.facts["weights"], UNIT_ROUNDOFF[precision]
        names = tuple(exact)
        with np.errstate(all="ignore"):
            off = np.array([abs(exact[name].minus(answer[name])) for name in names])
            size = np.array([np.broadcast_to(abs(exact[name].high), off.shape[1:]) for name in names])
            weight = np.array([np.broadcast_to(weights[name], off.shape[1:]) for name in names])
            match ladder.options["natural"]:
                case "roundings":
                    error = np.where(off == 0, 0.0, off / (size * u))
                case "roundings of the largest":
                    error = off / (size.max(axis=0) * u)
                case "pixels":
                    error = off * (inputs["width"] / 2 if ladder.slots[0] == "ndc" else 1.0)
                case _:
                    error = off
            # No number is nearer than its own rounding, even one that is mostly a constant.
            index = np.where(off == 0, 0.0, off / (np.maximum(weight, size) * u)).max(axis=0)
        none, invalid = nothing(off.shape[1]), ~np.all(np.isfinite(off), axis=0)
        return Grades(
            counted=truth.counted,
            false_hit=none,
            false_miss=none,
            invalid=invalid,
            error=np.where(invalid, np.nan, error.max(axis=0)),
            index=np.where(invalid, np.nan, index),
        )
