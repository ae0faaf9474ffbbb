"""Does a feeler that starts on a surface see the light? Acne where it is lit, leaks where it is in shadow, as a pair.

Every ray asks both. Lit: the own surface alone, which a light above the horizon can never be behind (on a sphere seen
from outside and on a plane the own root is divided out by algebra: truth knows no epsilon). Shadowed: a blocker, a
plane `gap` above the hit along the normal, between the hit and the light; truth is by construction, the gap being far
larger than the blocker's own rounding. With an input `blocker` the plane stands through that point instead, before the
light or behind it: rationals say which, and behind it nothing may be stopped.
Inputs: o, d, point (on the surface), normal, gap, light; curved surfaces also c, r. Acne is a false miss of light, a
leak a false hit.
"""

from typing import Any

import drjit as dr
import numpy as np

from rayproof.cases.ladders import Inputs, Ladder
from rayproof.reports.studies.stability.device import downloaded, uploaded
from rayproof.reports.studies.stability.exactly import Columns, confirmed, decided, rational, sample, single
from rayproof.reports.studies.stability.geometry import ahead, ray_of
from rayproof.reports.studies.stability.mathematics import dot, minus
from rayproof.reports.studies.stability.questions import QUESTIONS, Answer, Grades, Truth, Witness
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.formulas import FORMULAS, Formula
from rayproof.tracer.kernel.arrays import ArrayTypes, array_types
from rayproof.tracer.rays import Hit, Interval, Ray
from rayproof.tracer.shapes.bounds import clearance
from rayproof.tracer.shapes.primitives import SphereArrays

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
    """The slots `feeler`, `segment` and `obstructed`, each with the defaults of the others."""

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
        """Return where the own surface, and where the blocker, stops the feeler."""
        types = array_types(precision)
        configuration = Configuration(precision=precision, formulas={formula.slot: formula.variant})
        strategy = configuration.formula("feeler")
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
        feeler = Ray(origin=start.origin, direction=direction)
        interval = Interval(nearest=types.Float(start.nearest), farthest=types.Float(end * (1 - start.shorter)))
        skipped = start.skip is not None and not ladder.options.get("adjacent")
        own = types.Bool(False) if skipped else self._own(ladder, columns, feeler, interval)
        blocker = columns.get("blocker", columns["point"] + columns["normal"] * columns["gap"])
        t = plane_t(feeler, blocker, columns["normal"])
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

    def _own(self, ladder: Ladder, x: Columns, feeler: Ray, interval: Interval) -> Any:
        if ladder.options.get("surface") == "sphere":
            return self._sphere(x, feeler, interval) < dr.inf
        return met(plane_t(feeler, x["point"], x["normal"]), interval)

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
    rays = [single(inputs, int(ray), rational) for ray in sample(rungs)]
    wrong = sum(
        dot(minus(x["light"], x["point"]), x["normal"]) <= x["gap"] * dot(x["normal"], x["normal"]) for x in rays
    )
    return Witness(len(rays), float(wrong))
