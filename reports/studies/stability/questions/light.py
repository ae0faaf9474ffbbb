"""Questions of irradiance and cosine (in ulps), of shadow rays and blockers, and of decisions (clip, below, side).

Truth is computed by balls alone, ray for ray: products of these lengths leave float64's exponents, where pairs end.
Inputs: flux, normal, away.
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
from rayproof.reports.studies.stability.questions import QUESTIONS, Answer, Grades, Truth, Witness, nothing, sample
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
class Light:
    """The slots falloff and cosine."""

    def truth(self, ladder: Ladder, inputs: Inputs, rungs: np.ndarray) -> Truth:
        """Return the balls."""
        slot = ladder.slots[0]
        with bits(BITS):
            balls = [light_of(slot, single(inputs, ray, arb)) for ray in range(len(rungs))]
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


# Does a shadow ray that starts on a surface see the light? Acne where it is lit, leaks where it is in shadow, as a
# pair.
#
# Every ray asks both. Lit: the own surface alone, which a light above the horizon can never be behind (on a sphere
# seen from outside and on a plane the own root is divided out by algebra: truth knows no epsilon). Shadowed: a
# blocker, a plane `gap` above the hit along the normal, between the hit and the light; truth is by construction, the
# gap being far larger than the blocker's own rounding. With an input `blocker` the plane stands through that point
# instead, before the light or behind it: rationals say which, and behind it nothing may be stopped. Inputs: o, d,
# point (on the surface), normal, gap, light; curved surfaces also c, r. Acne is a false miss of light, a leak a false
# hit.


OWN = 0  # index of the surface that was hit
FLOAT64 = "float64"


def plane_t(ray: Ray, point: Any, normal: Any) -> Any:
    """Return the t at which a ray meets the plane through `point`; subtracting first, as the tracer's shapes do."""
    return dr.dot(normal, point - ray.origin) / dr.dot(normal, ray.direction)


def met(t: Any, interval: Interval) -> Any:
    """Return where t counts."""
    return interval.contains(t)


@QUESTIONS.register("shadow")
class Shadow:
    """The slots `shadow_ray`, `segment` and `obstructed`, each with the defaults of the others."""

    def truth(self, ladder: Ladder, inputs: Inputs, rungs: np.ndarray) -> Truth:
        """Return which rays count: eye and light are on the same side, and the way to the light crosses the gap."""
        view = np.sum(inputs["normal"] * inputs["d"], axis=1)
        way = inputs["light"] - inputs["point"]
        lit = np.sum(way * inputs["normal"], axis=1)
        counted = (view < 0) & (lit > 2 * inputs["gap"])
        if "blocker" not in inputs:
            return Truth(counted=counted, facts={"blocked": counted}, witness=_witness(inputs, rungs))
        signs = decided(before_light, inputs)
        witness = Witness(*confirmed(before_light, inputs, signs, sample(rungs)))
        return Truth(counted=counted, facts={"blocked": signs["before"] > 0}, witness=witness)

    def answer(self, ladder: Ladder, formula: Formula, inputs: Inputs, precision: str) -> Answer:
        """Return where the own surface, and where the blocker, stops the shadow ray."""
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
        one = types.Float(1.0)
        return downloaded({"own": dr.select(own, one, 0), "stopped": dr.select(stopped, one, 0)}, len(inputs["o"]))

    def _hit(self, ladder: Ladder, x: Columns, types: ArrayTypes) -> Columns:
        """Return the hit as the tracer computes it: t by the default formula, o + t d, normal, clearance."""
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

    def grade(self, ladder: Ladder, inputs: Inputs, truth: Truth, answer: Answer, precision: str) -> Grades:
        """Return acne as false misses and leaks as false hits (of light)."""
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
    """Return what is positive where the blocker's plane stands before the light, as seen from the point."""
    return {"before": dot(minus(x["light"], x["blocker"]), x["normal"])}


def _witness(inputs: Inputs, rungs: np.ndarray) -> Witness:
    """Confirm by rationals that the blocker stands between the plane of the hit and the light."""
    rays = [single(inputs, int(ray), exact) for ray in sample(rungs)]
    wrong = sum(
        dot(minus(x["light"], x["point"]), x["normal"]) <= x["gap"] * dot(x["normal"], x["normal"]) for x in rays
    )
    return Witness(len(rays), float(wrong))


# Does a formula decide rightly? For slots that answer yes or no to a question about signs.
#
# One entry of `ASKED` a slot: the numbers whose signs decide, what they decide, and how the formula is asked. Exact
# rationals settle what pairs leave in doubt, ties included; balls confirm a sample. A wrong yes is a false hit.


@dataclass(frozen=True, kw_only=True)
class Asked:
    """One slot: the numbers whose signs decide, where they say yes, and how a formula is asked."""

    predicates: Mathematics
    yes: Callable[[Signs], np.ndarray]
    ask: Callable[[Formula, Columns], Any]


def _between(signs: Signs) -> np.ndarray:
    return (signs["after"] > 0) & (signs["before"] > 0)


def _within(formula: Formula, x: Columns) -> Any:
    """Return whether t lies in what a clipping formula leaves of a ray."""
    near, far = formula.function(x["direction"], x["forward"], x["near"], x["far"])
    return Interval(nearest=near, farthest=far).contains(x["t"])


def _below(formula: Formula, x: Columns) -> Any:
    cosine = FORMULAS[f"cosine/{FORMULAS.slots['cosine']}"].function
    return formula.function(cosine(x["n"], x["d"]))


ASKED: Mapping[str, Asked] = {
    "clip_depth": Asked(
        predicates=lambda x: {
            "after": x["t"] * dot(x["direction"], x["forward"]) - x["near"],
            "before": x["far"] - x["t"] * dot(x["direction"], x["forward"]),
        },
        yes=_between,
        ask=_within,
    ),
    "clip_shell": Asked(
        predicates=lambda x: {"after": x["t"] - x["near"], "before": x["far"] - x["t"]}, yes=_between, ask=_within
    ),
    "clip_none": Asked(predicates=lambda x: {"t": x["t"] + 0}, yes=lambda signs: signs["t"] > 0, ask=_within),
    "hidden": Asked(
        predicates=lambda x: {"side": dot(x["n"], x["d"])},
        yes=lambda signs: signs["side"] >= 0,
        ask=lambda formula, x: formula.function(x["n"], x["d"]),
    ),
    "horizon": Asked(
        predicates=lambda x: {"side": dot(x["n"], x["d"])}, yes=lambda signs: signs["side"] <= 0, ask=_below
    ),
}


@QUESTIONS.register("decision")
class Decision:
    """The decision of the ladder's only slot."""

    def truth(self, ladder: Ladder, inputs: Inputs, rungs: np.ndarray) -> Truth:
        """Return the exact decisions."""
        (slot,) = ladder.slots
        signs = decided(ASKED[slot].predicates, inputs)
        witness = Witness(*confirmed(ASKED[slot].predicates, inputs, signs, sample(rungs)))
        yes = ASKED[slot].yes(signs)
        return Truth(counted=np.ones(len(rungs), dtype=bool), facts={"yes": yes}, witness=witness)

    def answer(self, ladder: Ladder, formula: Formula, inputs: Inputs, precision: str) -> Answer:
        """Return 1 for yes, 0 for no."""
        types = array_types(precision)
        said = ASKED[formula.slot].ask(formula, uploaded(inputs, types))
        return downloaded({"yes": types.Float(said)}, len(next(iter(inputs.values()))))

    def grade(self, ladder: Ladder, inputs: Inputs, truth: Truth, answer: Answer, precision: str) -> Grades:
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
