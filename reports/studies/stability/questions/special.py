"""Special values: whatever comes in, what comes out is a valid miss or a flagged invalid, never a plausible number.

A NaN distance is flagged: nothing is nearer than a NaN. A subnormal t may be flushed to zero. Counted as false hits: a
finite or negative t where a number of the ray or shape is none, or no finite one; a unit direction from such a camera;
light that is a plain number, black included, though a NaN went in. Zeros of either sign, where nothing else is
special, are decided by exact mathematics.
"""

from collections.abc import Mapping

import numpy as np
from flint import arb, ctx

from rayproof.cases.ladders import Inputs, Ladder
from rayproof.reports.studies.stability.device import downloaded, uploaded
from rayproof.reports.studies.stability.exactly import WITNESS_BITS, Columns, Mathematics, single
from rayproof.reports.studies.stability.mathematics import dot
from rayproof.reports.studies.stability.questions import QUESTIONS, Answer, Grades, Truth, Witness, nothing
from rayproof.reports.studies.stability.questions.distance import Distance
from rayproof.reports.studies.stability.questions.view_ray import ViewRay, looking, tangents
from rayproof.reports.studies.stability.shapes import SHAPES, towards
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.formulas import Formula
from rayproof.tracer.kernel.arrays import array_types

MATTERS = ("eye", "target", "up", "sx", "sy")  # of a camera, for a direction
MOST = 200  # rays


def impossible(values: Mathematics, inputs: Mapping[str, np.ndarray], asked: np.ndarray) -> Witness:
    """Return the witness that what is asked of the rays `asked` (rays,) bool has no finite answer.

    A ball around NaN stays no number through whatever it takes part in. A sample of rays is worked out by `values`; one
    whose values all come out finite contradicts the truth, which is then a whole 1 from its witness.
    """
    rays = np.flatnonzero(asked)
    chosen = rays[:: max(1, len(rays) // MOST)]
    worst = 0.0
    old, ctx.prec = ctx.prec, WITNESS_BITS
    try:
        for ray in chosen:
            balls = values(single(inputs, int(ray), arb)).values()
            if all(ball.is_finite() for ball in balls):
                worst = 1.0
    finally:
        ctx.prec = old
    return Witness(len(chosen), worst)


def dark(inputs: Mapping[str, np.ndarray]) -> Witness:
    """Return the witness that no light arrives: each light lies at its point, or not above the point's horizon."""
    rays = np.arange(0, len(inputs["flux"]), max(1, len(inputs["flux"]) // MOST))
    worst = 0.0
    old, ctx.prec = ctx.prec, WITNESS_BITS
    try:
        for ray in rays:
            x = single(inputs, int(ray), arb)
            height = sum((n * a for n, a in zip(x["normal"], x["away"], strict=True)), arb(0))
            if not height <= 0:
                worst = 1.0
    finally:
        ctx.prec = old
    return Witness(len(rays), worst)


def finite(inputs: Inputs, names: tuple[str, ...] | None = None) -> np.ndarray:
    """Return the rays whose inputs (those of `names`) are all finite."""
    columns = [inputs[name].reshape(len(inputs[name]), -1) for name in names or tuple(inputs)]
    return np.all(np.isfinite(np.concatenate(columns, axis=1)), axis=1)


def ordinary(inputs: Inputs) -> np.ndarray:
    """Return the rays whose numbers are zeros or of moderate size."""
    columns = np.concatenate([array.reshape(len(array), -1) for array in inputs.values()], axis=1)
    with np.errstate(invalid="ignore"):
        return np.all((columns == 0) | ((abs(columns) > 1e-3) & (abs(columns) < 1e3)), axis=1)


def marks(counted: np.ndarray, plausible: np.ndarray, lost: np.ndarray, invalid: np.ndarray) -> Grades:
    """Return grades without errors."""
    unknown = np.full(len(counted), np.nan)
    return Grades(counted=counted, false_hit=plausible, false_miss=lost, invalid=invalid, error=unknown, index=unknown)


@QUESTIONS.register("special_distance")
class SpecialDistance:
    """The t of a shape."""

    def truth(self, ladder: Ladder, inputs: Inputs, rungs: np.ndarray) -> Truth:
        """Return what is finite, and exact hits where every number is a zero or ordinary."""
        plain = ordinary(inputs)
        kept = {name: array[plain] for name, array in inputs.items()}
        exact = Distance().truth(ladder, kept, rungs[plain])
        hit = nothing(len(plain))
        hit[plain] = exact.facts["hit"].hit
        # Where a ray meets z = 0 is a question about heights alone.
        seen = inputs
        if ladder.options["shape"] == "plane":
            seen = {name: array[:, 2] for name, array in inputs.items()}
        facts = {"finite": finite(seen), "plain": plain, "hit": hit}
        given = inputs | {"towards": towards(inputs["d"])} if ladder.options["shape"] == "cube" else inputs
        shape = SHAPES[str(ladder.options["shape"])]()
        # An infinite direction may have a limit; what is no number at all has none, in the distance or in a decision.
        unknown = np.any([np.isnan(array.reshape(len(plain), -1)).any(axis=1) for array in seen.values()], axis=0)
        none = impossible(lambda x: shape.values(x) | shape.predicates(x), given, unknown)
        witness = Witness(exact.witness.values + none.values, max(exact.witness.worst, none.worst))
        return Truth(counted=~nothing(len(plain)), facts=facts, witness=witness)

    def answer(self, ladder: Ladder, formula: Formula, inputs: Inputs, precision: str) -> Answer:
        """Return t."""
        return Distance().answer(ladder, formula, inputs, precision)

    def grade(self, ladder: Ladder, inputs: Inputs, truth: Truth, answer: Answer, precision: str) -> Grades:
        """Return plausible answers to impossible questions, and wrong ones to questions about zeros."""
        t, facts = answer["t"], truth.facts
        found = np.isfinite(t)
        negative = t < 0
        plausible = (found & ~facts["finite"]) | negative | (found & facts["plain"] & ~facts["hit"])
        return marks(truth.counted, plausible, ~found & facts["hit"], nothing(len(t)))


@QUESTIONS.register("special_camera")
class SpecialCamera:
    """The direction of a camera."""

    def truth(self, ladder: Ladder, inputs: Inputs, rungs: np.ndarray) -> Truth:
        """Return which cameras are no cameras."""
        known = finite(inputs, MATTERS)
        high, low = tangents(inputs["fovy"])
        given = {name: inputs[name] for name in (*MATTERS, "aspect")} | {"tangent": high, "tangent_rest": low}
        return Truth(counted=~known, facts={}, witness=impossible(looking, given, ~known))

    def answer(self, ladder: Ladder, formula: Formula, inputs: Inputs, precision: str) -> Answer:
        """Return directions."""
        return ViewRay().answer(ladder, formula, inputs, precision)

    def grade(self, ladder: Ladder, inputs: Inputs, truth: Truth, answer: Answer, precision: str) -> Grades:
        """Return plausible directions."""
        length = np.linalg.norm(answer["d"], axis=1)
        plausible = truth.counted & (abs(length - 1) < 0.5)
        return marks(truth.counted, plausible, nothing(len(length)), nothing(len(length)))


def brought(formula: Formula, x: Columns, precision: str) -> Columns:
    """Return the irradiance of one light by a formula and the defaults around it."""
    configuration = Configuration(precision=precision, formulas={formula.slot: formula.variant})
    law = configuration.formula("falloff")
    away = x["away"]
    squared = away.x * away.x + away.y * away.y + away.z * away.z
    cosine = configuration["cosine"](x["normal"], away)
    if formula.slot == "simplified":
        return {"E": configuration["simplified"](x["flux"], cosine)}
    facing = law.function(x["flux"], away if law.facts.get("by") == "away" else squared)
    return {"E": configuration["lambert"](facing, cosine)}


def lit(x: Columns) -> Columns:
    """Return Phi dot(N, L) / (4 pi r^2), of whatever numbers."""
    squared = dot(x["away"], x["away"])
    return {"E": x["flux"] * dot(x["normal"], x["away"]) / (4 * arb.pi() * squared * squared.sqrt())}


@QUESTIONS.register("special_light")
class SpecialLight:
    """The irradiance of one light: what a NaN becomes."""

    def truth(self, ladder: Ladder, inputs: Inputs, rungs: np.ndarray) -> Truth:
        """Return where a NaN must come out: geometry that is none, or a flux that is none above the horizon."""
        nowhere = np.any(np.isnan(inputs["normal"]) | np.isnan(inputs["away"]), axis=1)
        with np.errstate(all="ignore"):
            # Inputs of moderate size alone are surely above the horizon where their product says so.
            usual = np.all(abs(inputs["normal"]) < 2, axis=1) & np.all(abs(inputs["away"]) < 10, axis=1)
            above = usual & (np.sum(inputs["normal"] * inputs["away"], axis=1) > 0.01)
        counted = nowhere | (np.isnan(inputs["flux"]) & above)
        return Truth(counted=counted, facts={}, witness=impossible(lit, inputs, counted))

    def answer(self, ladder: Ladder, formula: Formula, inputs: Inputs, precision: str) -> Answer:
        """Return the irradiance."""
        x = uploaded(inputs, array_types(precision))
        return downloaded(brought(formula, x, precision), len(inputs["flux"]))

    def grade(self, ladder: Ladder, inputs: Inputs, truth: Truth, answer: Answer, precision: str) -> Grades:
        """Return numbers that hide a NaN."""
        none = nothing(len(answer["E"]))
        return marks(truth.counted, truth.counted & ~np.isnan(answer["E"]), none, none)


@QUESTIONS.register("dark_light")
class DarkLight:
    """The irradiance of a light that brings none: exactly at the point, behind the surface, or exactly along it."""

    def truth(self, ladder: Ladder, inputs: Inputs, rungs: np.ndarray) -> Truth:
        """Return that all count: the generator made them so, by zeros and signs."""
        return Truth(counted=~nothing(len(rungs)), facts={}, witness=dark(inputs))

    def answer(self, ladder: Ladder, formula: Formula, inputs: Inputs, precision: str) -> Answer:
        """Return the irradiance."""
        x = uploaded(inputs, array_types(precision))
        return downloaded(brought(formula, x, precision), len(inputs["flux"]))

    def grade(self, ladder: Ladder, inputs: Inputs, truth: Truth, answer: Answer, precision: str) -> Grades:
        """Return light where there is none, and NaN."""
        value = answer["E"]
        return marks(truth.counted, ~np.isnan(value) & (value != 0), nothing(len(value)), np.isnan(value))
