"""Questions of values: matrices, projections, corners, pixels, sums of light; and of special inputs (NaN, inf).

One entry of `ASKED` a slot: the exact mathematics, and how the formula is asked. K is what the very expression makes
of one rounding of each input (`Conditioned` in `stability/shapes.py`). The error of a ray is that of its worst number.
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
from rayproof.reference.certified.bundles import Bundle, constant, floats
from rayproof.reference.certified.columns import WITNESS_BITS, Columns, Mathematics, evaluated, parts, single, witnessed
from rayproof.reference.certified.fields import precision as bits
from rayproof.reference.certified.meetings import SHAPES, towards
from rayproof.reference.certified.numbers import dot, plus, scaled
from rayproof.reports.studies.stability.device import downloaded, uploaded
from rayproof.reports.studies.stability.questions import QUESTIONS, Answer, Grades, Truth, Witness, nothing, sample
from rayproof.reports.studies.stability.questions.placed import Distance
from rayproof.reports.studies.stability.questions.rays import ViewRay, looking, tangents
from rayproof.reports.studies.stability.shapes import Conditioned
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.formulas import Formula
from rayproof.tracer.formulas.camera import ORDER
from rayproof.tracer.kernel.arithmetic import matrix
from rayproof.tracer.kernel.arrays import array_types

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
        across, upwards = scaled(x["right"], sx * x["horizontal"]), scaled(x["up"], sy * x["vertical"])
        found.append(plus(x["eye"], scaled(plus(plus(x["forward"], across), upwards), depth)))
    return numbered(found)


def lights(x: Columns) -> list[Any]:
    """Return the contributions light0, light1, ..."""
    return [x[f"light{k}"] for k in range(sum(name.startswith("light") for name in x))]


def pi(like: Any) -> Any:
    """Return pi as a number of the same kind; it is rounded as an input is."""
    if isinstance(like, Bundle):
        with bits(WITNESS_BITS):
            return constant(arb.pi())
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
            off = np.array([abs((exact[name] - floats(answer[name])).high) for name in names])
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


# Special values: whatever comes in, what comes out is a valid miss or a flagged invalid, never a plausible number.
#
# A NaN distance is flagged: nothing is nearer than a NaN. A subnormal t may be flushed to zero. Counted as false
# hits: a finite or negative t where a number of the ray or shape is none, or no finite one; a unit direction from
# such a camera; light that is a plain number, black included, though a NaN went in. Zeros of either sign, where
# nothing else is special, are decided by exact mathematics.


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
    with bits(WITNESS_BITS):
        for ray in chosen:
            balls = values(single(inputs, int(ray), arb)).values()
            if all(ball.is_finite() for ball in balls):
                worst = 1.0
    return Witness(len(chosen), worst)


def dark(inputs: Mapping[str, np.ndarray]) -> Witness:
    """Return the witness that no light arrives: each light lies at its point, or not above the point's horizon."""
    rays = np.arange(0, len(inputs["flux"]), max(1, len(inputs["flux"]) // MOST))
    worst = 0.0
    with bits(WITNESS_BITS):
        for ray in rays:
            x = single(inputs, int(ray), arb)
            height = sum((n * a for n, a in zip(x["normal"], x["away"], strict=True)), arb(0))
            if not height <= 0:
                worst = 1.0
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
        numbers = inputs
        if ladder.options["shape"] == "plane":
            numbers = {name: array[:, 2] for name, array in inputs.items()}
        facts = {"finite": finite(numbers), "plain": plain, "hit": hit}
        given = inputs | {"towards": towards(inputs["d"])} if ladder.options["shape"] == "cube" else inputs
        shape = SHAPES[str(ladder.options["shape"])]()
        # An infinite direction may have a limit; what is no number at all has none, in the distance or in a decision.
        unknown = np.any([np.isnan(array.reshape(len(plain), -1)).any(axis=1) for array in numbers.values()], axis=0)
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
