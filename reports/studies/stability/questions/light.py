"""Irradiance and cosine of one light, error in ulps of the result; beyond the largest float an infinity is right.

Truth is computed by balls alone, ray for ray: products of these lengths leave float64's exponents, where pairs end.
Inputs: flux, normal, away.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
from flint import arb, ctx

from rayproof.cases.ladders import Inputs, Ladder
from rayproof.reports.studies.stability.device import downloaded, uploaded
from rayproof.reports.studies.stability.exactly import Columns, single
from rayproof.reports.studies.stability.mathematics import dot
from rayproof.reports.studies.stability.questions import QUESTIONS, Answer, Grades, Truth, Witness, nothing
from rayproof.tracer.formulas import Formula
from rayproof.tracer.kernel.arrays import array_types

BITS = 256
DTYPES: Mapping[str, type[np.floating]] = {"float32": np.float32, "float64": np.float64}


def exact(slot: str, x: Columns) -> arb:
    """Return Phi / (4 pi r^2), or the cosine; 0 for a light at the point, where irradiance is defined to be 0."""
    squared = dot(x["away"], x["away"])
    if squared.is_zero():
        return arb(0)
    if slot == "falloff":
        return x["flux"] / (4 * arb.pi() * squared)
    return dot(x["normal"], x["away"]) / squared.sqrt()


@QUESTIONS.register("light")
class Light:
    """The slots falloff and cosine."""

    def truth(self, ladder: Ladder, inputs: Inputs, rungs: np.ndarray) -> Truth:
        """Return the balls."""
        slot = ladder.slots[0]
        old, ctx.prec = ctx.prec, BITS
        try:
            balls = [exact(slot, single(inputs, ray, arb)) for ray in range(len(rungs))]
        finally:
            ctx.prec = old
        worst = max((float(ball.rel_accuracy_bits() < 100) for ball in balls if not ball.is_zero()), default=0.0)
        return Truth(counted=~nothing(len(rungs)), facts={"balls": balls}, witness=Witness(len(balls), worst))

    def answer(self, ladder: Ladder, formula: Formula, inputs: Inputs, precision: str) -> Answer:
        """Return the formula's value."""
        types = array_types(precision)
        x = uploaded(inputs, types)
        if formula.slot == "cosine":
            value = formula.function(x["normal"], x["away"])
        else:
            by_vector = formula.facts.get("by") == "away"
            squared = x["away"].x * x["away"].x + x["away"].y * x["away"].y + x["away"].z * x["away"].z
            value = formula.function(x["flux"], x["away"] if by_vector else squared)
        return downloaded({"value": value}, len(inputs["flux"]))

    def grade(self, ladder: Ladder, inputs: Inputs, truth: Truth, answer: Answer, precision: str) -> Grades:
        """Return errors in ulps (of the largest float where truth lies above it); absolute in u for "absolute"."""
        value, balls = answer["value"], truth.facts["balls"]
        limits = np.finfo(DTYPES[precision])
        error = np.array([_ulps(float(v), ball, limits, precision) for v, ball in zip(value, balls, strict=True)])
        if ladder.options.get("natural") == "absolute":
            error = np.array(
                [
                    float(abs(arb(float(v)) - ball).upper()) / float(limits.eps / 2) if np.isfinite(v) else np.nan
                    for v, ball in zip(value, balls, strict=True)
                ]
            )
        rays = len(value)
        invalid = np.isnan(value)
        return Grades(
            counted=truth.counted,
            false_hit=nothing(rays),
            # An answer that lost every digit is as bad as none: it counts, so that a median cannot hide it.
            false_miss=~invalid & (error > 2.0**20),
            invalid=invalid,
            error=np.where(invalid, np.nan, error),
            index=np.where(invalid, np.nan, error),
        )


def _ulps(value: float, ball: arb, limits: Any, precision: str) -> float:
    if np.isnan(value):
        return np.nan
    # Half an ulp above the largest float is where rounding to nearest gives an infinity.
    beyond = arb(float(limits.max)) * (1 + arb(float(limits.eps)) / 4)
    if bool(abs(ball) >= beyond):
        return 0.0 if np.isinf(value) and (value > 0) == bool(ball > 0) else 2.0**40
    if np.isinf(value):
        return 2.0**40
    size = float(DTYPES[precision](float(abs(ball.mid()))))
    size = min(size, float(limits.max)) if size > 0 else 0.0
    spacing = float(np.spacing(DTYPES[precision](size)))
    return float((abs(arb(value) - ball) / arb(spacing)).upper())
