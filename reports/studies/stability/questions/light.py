"""Questions of irradiance and cosine (in ulps), of shadow rays and blockers, and of decisions (clip, below, side).

The truth of irradiance and cosine is computed ray by ray in ball arithmetic, because products of these lengths overflow
the exponents of float64 and so of pairs. Their inputs: flux, normal, away.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import drjit as dr
import numpy as np
from flint import arb

from rayproof.cases.ladders import Inputs, Ladder
from rayproof.reference.certified.columns import Columns, Mathematics, confirmed, decided, single
from rayproof.reference.certified.fields import exact
from rayproof.reference.certified.fields import precision as bits
from rayproof.reference.certified.meetings import Signs
from rayproof.reference.certified.numbers import dot, minus
from rayproof.reports.studies.stability.device import downloaded, uploaded
from rayproof.reports.studies.stability.questions import (
    QUESTIONS,
    Answer,
    ExactAnswers,
    Grades,
    Witness,
    nothing,
    sample,
)
from rayproof.reports.studies.stability.shapes import ahead, ray_of
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.formulas import FORMULAS, Formula
from rayproof.tracer.kernel.arrays import ArrayTypes, array_types
from rayproof.tracer.rays import Hit, Interval, Ray
from rayproof.tracer.shapes.bounds import clearance
from rayproof.tracer.shapes.primitives import SphereArrays

BITS = 256
DTYPES: Mapping[str, type[np.floating]] = {"float32": np.float32, "float64": np.float64}


def light_of(slot: str, x: Columns) -> arb:
    """Return Phi / (4 pi r^2), or the cosine; 0 for a light at the point, where irradiance is defined to be 0."""
    squared = dot(x["away"], x["away"])
    if squared.is_zero():
        return arb(0)
    if slot == "falloff":
        return x["flux"] / (4 * arb.pi() * squared)
    return dot(x["normal"], x["away"]) / squared.sqrt()


@QUESTIONS.register("light")
class LightQuestion:
    """The slots falloff and cosine."""

    def truth(self, ladder: Ladder, inputs: Inputs, rungs: np.ndarray) -> ExactAnswers:
        """Return the exact values as balls."""
        slot = ladder.slots[0]
        with bits(BITS):
            balls = [light_of(slot, single(inputs, ray, arb)) for ray in range(len(rungs))]
        worst = max((float(ball.rel_accuracy_bits() < 100) for ball in balls if not ball.is_zero()), default=0.0)
        return ExactAnswers(counted=~nothing(len(rungs)), facts={"balls": balls}, witness=Witness(len(balls), worst))

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

    def grade(self, ladder: Ladder, inputs: Inputs, truth: ExactAnswers, answer: Answer, precision: str) -> Grades:
        """Return errors in ulps, or absolute errors in u if the ladder's option `natural` is "absolute".

        An ulp is at most that of the largest float. If the truth overflows to an infinity, this infinity has the error
        0 and any other answer an error of 2^40 ulps.
        """
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
            # An answer without a correct digit counts as a miss, so that a median cannot hide it.
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


# Does a shadow ray from a surface reach the light? Acne (lit points in shadow) and leaks (light behind a blocker).
#
# Every ray is tested twice. Lit: only the surface at the origin is in the scene, and it never hides a light above the
# horizon (on a plane, and on a sphere seen from outside, the root at the origin is divided out by algebra: the truth
# needs no epsilon). Shadowed: a blocker is between the hit and the light, a plane `gap` above the hit along the normal.
# Its truth holds by construction, because the gap is far larger than the rounding of the blocker. With an input
# `blocker` the plane contains that point instead and is before or behind the light, as decided by rationals; behind the
# light it must not block. Inputs: o, d, point (on the surface), normal, gap, light; for curved surfaces also c, r. Acne
# is a false miss of light, a leak is a false hit.


OWN = 0  # index of the surface at the shadow ray's origin
FLOAT64 = "float64"


def plane_t(ray: Ray, point: Any, normal: Any) -> Any:
    """Return the t at which a ray hits the plane through `point`; it subtracts first, as the tracer's shapes do."""
    return dr.dot(normal, point - ray.origin) / dr.dot(normal, ray.direction)


def met(t: Any, interval: Interval) -> Any:
    """Return the mask of t inside an interval."""
    return interval.contains(t)


@QUESTIONS.register("shadow")
class Shadow:
    """The slots `shadow_ray`, `segment` and `obstructed`, each with the defaults of the others."""

    def truth(self, ladder: Ladder, inputs: Inputs, rungs: np.ndarray) -> ExactAnswers:
        """Return the counted rays: eye and light are on the same side, and the light is above twice the gap."""
        view = np.sum(inputs["normal"] * inputs["d"], axis=1)
        way = inputs["light"] - inputs["point"]
        lit = np.sum(way * inputs["normal"], axis=1)
        counted = (view < 0) & (lit > 2 * inputs["gap"])
        if "blocker" not in inputs:
            return ExactAnswers(counted=counted, facts={"blocked": counted}, witness=_witness(inputs, rungs))
        signs = decided(before_light, inputs)
        witness = Witness(*confirmed(before_light, inputs, signs, sample(rungs)))
        return ExactAnswers(counted=counted, facts={"blocked": signs["before"] > 0}, witness=witness)

    def answer(self, ladder: Ladder, formula: Formula, inputs: Inputs, precision: str) -> Answer:
        """Return the masks of shadow rays that hit their own surface, and that the blocker stops."""
        types = array_types(precision)
        configuration = Configuration(precision=precision, formulas={formula.slot: formula.variant})
        strategy = configuration.formula("shadow_ray")
        columns = uploaded(inputs, types)
        columns = columns | self._hit(ladder, columns, types)
        wide = bool(strategy.facts.get("doubles", False)) and precision != FLOAT64
        if wide:
            types = array_types(FLOAT64)
            wider = uploaded(inputs, types)
            columns = wider | self._hit(ladder, wider, types)
        away = columns["light"] - columns["p"]
        reach = dr.norm(away)
        cosine = dr.dot(columns["n"], away) / reach
        hit = Hit(
            position=columns["p"],
            normal=columns["n"],
            shape=types.Int(OWN),
            clearance=columns["clearance"],
            ray=ray_of(columns),
            distance=columns["t"],
        )
        start = strategy.function(hit, cosine, reach)
        direction, end = configuration["segment"](start.origin, columns["light"])
        shadow_ray = Ray(origin=start.origin, direction=direction)
        interval = Interval(nearest=types.Float(start.nearest), farthest=types.Float(end * (1 - start.shorter)))
        skipped = start.skip is not None and not ladder.options.get("adjacent")
        own = types.Bool(False) if skipped else self._own(ladder, columns, shadow_ray, interval)
        blocker = columns.get("blocker", columns["point"] + columns["normal"] * columns["gap"])
        t = plane_t(shadow_ray, blocker, columns["normal"])
        stopped = configuration["obstructed"](dr.select(met(t, interval), t, dr.inf))
        if start.skip is not None and ladder.options.get("self_shadow"):
            stopped = types.Bool(False)
        unity = types.Float(1.0)
        return downloaded({"own": dr.select(own, unity, 0), "stopped": dr.select(stopped, unity, 0)}, len(inputs["o"]))

    def _hit(self, ladder: Ladder, x: Columns, types: ArrayTypes) -> Columns:
        """Return the hit as the tracer computes it: t by the default formula, point, normal, clearance."""
        ray = ray_of(x)
        if ladder.options.get("surface") == "sphere":
            t = self._sphere(x, ray, ahead(types))
            p = ray.at(t)
            n, size = dr.normalize(p - x["c"]), dr.norm(x["c"]) + x["r"]
        else:
            t = plane_t(ray, x["point"], x["normal"])
            p, n, size = ray.at(t), x["normal"], dr.norm(x["point"])
        if ladder.options.get("reprojected"):
            p = dr.fma(n, x["r"], x["c"])
        scale = dr.norm(x["o"]) + t + size
        return {"t": t, "p": p, "n": n, "clearance": clearance(scale, spread=1.0, precision=types.precision)}

    @staticmethod
    def _sphere(x: Columns, ray: Ray, interval: Interval) -> Any:
        intersect = FORMULAS[f"sphere/{FORMULAS.slots['sphere']}"].function
        return intersect(ray, SphereArrays(center=x["c"], radius=x["r"]), interval)

    def _own(self, ladder: Ladder, x: Columns, shadow_ray: Ray, interval: Interval) -> Any:
        if ladder.options.get("surface") == "sphere":
            return self._sphere(x, shadow_ray, interval) < dr.inf
        return met(plane_t(shadow_ray, x["point"], x["normal"]), interval)

    def grade(self, ladder: Ladder, inputs: Inputs, truth: ExactAnswers, answer: Answer, precision: str) -> Grades:
        """Return acne as false misses of light and leaks as false hits of light."""
        stopped, blocked = answer["stopped"] > 0, truth.facts["blocked"]
        acne = truth.counted & ((answer["own"] > 0) | (stopped & ~blocked))
        leak = truth.counted & blocked & ~stopped
        unknown = np.full(len(acne), np.nan)
        return Grades(
            counted=truth.counted,
            false_hit=leak,
            false_miss=acne,
            invalid=np.isnan(answer["own"]) & truth.counted,
            error=unknown,
            index=unknown,
            counts={"acne": acne, "leak": leak},
        )


def before_light(x: Columns) -> Columns:
    """Return a number that is positive if the blocker's plane is before the light, as seen from the point."""
    return {"before": dot(minus(x["light"], x["blocker"]), x["normal"])}


def _witness(inputs: Inputs, rungs: np.ndarray) -> Witness:
    """Confirm by rationals that the blocker is between the plane of the hit and the light."""
    rays = [single(inputs, int(ray), exact) for ray in sample(rungs)]
    wrong = sum(
        dot(minus(x["light"], x["point"]), x["normal"]) <= x["gap"] * dot(x["normal"], x["normal"]) for x in rays
    )
    return Witness(len(rays), float(wrong))


# Does a formula decide rightly? For slots with a yes or no that depends on signs.
#
# `ASKED` has one entry per slot: the numbers whose signs decide, the decision, and the call of the formula. Exact
# rationals decide signs that pairs leave undecided, ties included; balls confirm a sample. A wrong yes is a false hit.


@dataclass(frozen=True, kw_only=True)
class DecisionSlot:
    """One slot: the numbers whose signs decide, the decision from their signs, and the call of a formula."""

    predicates: Mathematics
    yes: Callable[[Signs], np.ndarray]
    ask: Callable[[Formula, Columns], Any]


def _between(signs: Signs) -> np.ndarray:
    return (signs["after"] > 0) & (signs["before"] > 0)


def _within(formula: Formula, x: Columns) -> Any:
    """Return the mask of t inside the interval that a clipping formula leaves of a ray."""
    near, far = formula.function(x["direction"], x["forward"], x["near"], x["far"])
    return Interval(nearest=near, farthest=far).contains(x["t"])


def _below(formula: Formula, x: Columns) -> Any:
    cosine = FORMULAS[f"cosine/{FORMULAS.slots['cosine']}"].function
    return formula.function(cosine(x["n"], x["d"]))


ASKED: Mapping[str, DecisionSlot] = {
    "clip_depth": DecisionSlot(
        predicates=lambda x: {
            "after": x["t"] * dot(x["direction"], x["forward"]) - x["near"],
            "before": x["far"] - x["t"] * dot(x["direction"], x["forward"]),
        },
        yes=_between,
        ask=_within,
    ),
    "clip_shell": DecisionSlot(
        predicates=lambda x: {"after": x["t"] - x["near"], "before": x["far"] - x["t"]}, yes=_between, ask=_within
    ),
    "clip_none": DecisionSlot(predicates=lambda x: {"t": x["t"] + 0}, yes=lambda signs: signs["t"] > 0, ask=_within),
    "hidden": DecisionSlot(
        predicates=lambda x: {"side": dot(x["n"], x["d"])},
        yes=lambda signs: signs["side"] >= 0,
        ask=lambda formula, x: formula.function(x["n"], x["d"]),
    ),
    "horizon": DecisionSlot(
        predicates=lambda x: {"side": dot(x["n"], x["d"])}, yes=lambda signs: signs["side"] <= 0, ask=_below
    ),
}


@QUESTIONS.register("decision")
class Decision:
    """The decision of the ladder's only slot."""

    def truth(self, ladder: Ladder, inputs: Inputs, rungs: np.ndarray) -> ExactAnswers:
        """Return the exact decisions."""
        (slot,) = ladder.slots
        signs = decided(ASKED[slot].predicates, inputs)
        witness = Witness(*confirmed(ASKED[slot].predicates, inputs, signs, sample(rungs)))
        yes = ASKED[slot].yes(signs)
        return ExactAnswers(counted=np.ones(len(rungs), dtype=bool), facts={"yes": yes}, witness=witness)

    def answer(self, ladder: Ladder, formula: Formula, inputs: Inputs, precision: str) -> Answer:
        """Return 1 for yes, 0 for no."""
        types = array_types(precision)
        decision = ASKED[formula.slot].ask(formula, uploaded(inputs, types))
        return downloaded({"yes": types.Float(decision)}, len(next(iter(inputs.values()))))

    def grade(self, ladder: Ladder, inputs: Inputs, truth: ExactAnswers, answer: Answer, precision: str) -> Grades:
        """Return wrong decisions."""
        answered, yes = answer["yes"] > 0, truth.facts["yes"]
        unknown = np.full(len(answered), np.nan)
        return Grades(
            counted=truth.counted,
            false_hit=answered & ~yes,
            false_miss=~answered & yes,
            invalid=np.zeros(len(answered), dtype=bool),
            error=unknown,
            index=unknown,
        )
