"""At which t does a ray meet a shape? Errors in the ladder's unit, and against K with the shape at the origin."""

from typing import Any

import numpy as np

from rayproof.cases.ladders import Inputs, Ladder
from rayproof.cases.rounding import UNIT_ROUNDOFF
from rayproof.reports.studies.stability.bounded_pairs import Pair
from rayproof.reports.studies.stability.device import downloaded, uploaded
from rayproof.reports.studies.stability.exactly import decided, evaluated, sample, witnessed
from rayproof.reports.studies.stability.geometry import ahead, ray_of, record
from rayproof.reports.studies.stability.questions import QUESTIONS, Answer, Grades, Truth, Witness, nothing
from rayproof.reports.studies.stability.shapes import SHAPES, Hit, towards
from rayproof.tracer.formulas import Formula
from rayproof.tracer.kernel.arrays import array_types

LENGTHS = {"sphere": ("o", "c", "r"), "triangle": ("o", "a", "b", "c")}


def exponents(inputs: Inputs, names: tuple[str, ...]) -> np.ndarray:
    """Return per ray the power of two of the largest absolute number among `names`."""
    columns = [inputs[name].reshape(len(inputs[name]), -1) for name in names]
    return np.frexp(abs(np.concatenate(columns, axis=1)).max(axis=1))[1]


def rescaled(inputs: Inputs, shape: str) -> tuple[Inputs, np.ndarray]:
    """Return inputs of size one, exactly, and the power of two that t was multiplied by. Pairs overflow otherwise."""
    lengths = exponents(inputs, LENGTHS[shape])
    speed = exponents(inputs, ("d",))
    shifts = dict.fromkeys(LENGTHS[shape], -lengths) | {"d": -speed}
    moved = {
        name: np.ldexp(array, shifts[name] if array.ndim == 1 else shifts[name][:, None])
        for name, array in inputs.items()
    }
    return moved, speed - lengths


@QUESTIONS.register("distance")
class Distance:
    """The t of the nearest hit in front of the ray, inf where there is none."""

    def truth(self, ladder: Ladder, inputs: Inputs, rungs: np.ndarray) -> Truth:
        """Return hit and t; a ray with a hit that pairs cannot place is not counted."""
        name = str(ladder.options["shape"])
        shape = SHAPES[name]()
        given, shift = rescaled(inputs, name) if name in LENGTHS else (inputs, np.zeros(len(rungs), dtype=int))
        if name == "cube":
            given = given | {"towards": towards(given["d"])}
        signs, values = decided(shape.predicates, given), evaluated(shape.values, given)
        hit = shape.decide(signs, values, given)
        witness = Witness(*witnessed(shape.values, given, values, sample(rungs)))
        counted = ~(hit.hit & ~np.isfinite(hit.t.high))
        return Truth(
            counted=counted, facts={"hit": hit, "given": given, "shift": shift, "shape": shape}, witness=witness
        )

    def answer(self, ladder: Ladder, formula: Formula, inputs: Inputs, precision: str) -> Answer:
        """Return t per ray."""
        types = array_types(precision)
        columns = uploaded(inputs, types)
        shape = record(str(ladder.options["shape"]), columns, types)
        return downloaded({"t": formula.function(ray_of(columns), shape, ahead(types))}, len(inputs["o"]))

    def grade(self, ladder: Ladder, inputs: Inputs, truth: Truth, answer: Answer, precision: str) -> Grades:
        """Return misses and errors; only rays that truly hit and were answered have an error."""
        return graded(ladder, truth, answer["t"], precision)


def graded(ladder: Ladder, truth: Truth, t: np.ndarray, precision: str) -> Grades:
    """Return the marks of answers `t`."""
    hit: Hit = truth.facts["hit"]
    given, u = truth.facts["given"], UNIT_ROUNDOFF[precision]
    found = np.isfinite(t)
    both = found & hit.hit & truth.counted
    with np.errstate(all="ignore"):
        off = np.where(both, abs(hit.t.minus(np.ldexp(t, truth.facts["shift"]))), np.nan)
        center = given[truth.facts["shape"].center] if truth.facts["shape"].center else 0.0
        reach = abs(given["o"] - center) + abs(hit.t.high[:, None] * given["d"])
        weight = np.sum(abs(hit.normal) * reach, axis=1) + hit.size
        slope = abs(np.sum(hit.normal * given["d"], axis=1))
        index = off * slope / (u * weight)
        error = off / natural(ladder, given, hit.t, u)
    return Grades(
        counted=truth.counted,
        false_hit=found & ~hit.hit & truth.counted,
        false_miss=~found & hit.hit & truth.counted,
        invalid=(np.isnan(t) & truth.counted) if t.size else nothing(0),
        error=error,
        index=index,
    )


def natural(ladder: Ladder, given: Inputs, t: Pair, u: float) -> Any:
    """Return what an error of t is divided by: |d| |dt| / r in radii, or roundings of t."""
    match ladder.options.get("natural", "roundings"):
        case "radii":
            return given["r"] / np.linalg.norm(given["d"], axis=1)
        case "relative":
            return abs(t.high)
        case _:
            return abs(t.high) * u
