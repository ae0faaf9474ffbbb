"""Questions of values: matrices, projections, corners, pixels, sums of light; and of special inputs (NaN, inf).

`ASKED` has one entry per slot: the exact mathematics, and the call of the formula. K is the amplification of one
rounding of each input by the exact expression (`Conditioned` in `stability/shapes.py`). The error of a ray is the error
of its worst number.
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
from rayproof.reports.studies.stability.questions import (
    QUESTIONS,
    Answer,
    ExactAnswers,
    Grades,
    Witness,
    nothing,
    sample,
)
from rayproof.reports.studies.stability.questions.placed import Distance
from rayproof.reports.studies.stability.questions.rays import ViewRay, looking, tangents
from rayproof.reports.studies.stability.shapes import Conditioned
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.formulas import Formula
from rayproof.tracer.formulas.camera import ORDER
from rayproof.tracer.kernel.arithmetic import matrix
from rayproof.tracer.kernel.arrays import array_types

PLACES = tuple(product(range(4), repeat=2))  # (row, column) of a 4x4 matrix
Ask = Callable[[Formula, Columns], Mapping[str, Any]]


@dataclass(frozen=True, kw_only=True)
class ValueSlot:
    """One slot: the exact mathematics of its numbers, and the call of a formula."""

    exact: Mathematics
    ask: Ask


def named(*names: str) -> Callable[[Any], Columns]:
    """Return a function that makes a dict of several results, with `names` as keys."""
    return lambda results: dict(zip(names, results, strict=True))


def numbered(vectors: Any) -> Columns:
    """Return the components of vectors, by the number of the vector and of the component."""
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
    """Return the inverse of the matrix m00 ... m33 by a formula."""
    result = formula.function(matrix([[x[f"m{i}{j}"] for j in range(4)] for i in range(4)], like=x["m00"]))
    return {f"{i}{j}": result[i, j] for i, j in PLACES}


def projected(x: Columns) -> Columns:
    """Return the four numbers of a projection that are neither 0 nor 1."""
    stretch = x["far"] / (x["far"] - x["near"])
    return {"00": 1 / x["horizontal"], "11": 1 / x["vertical"], "22": stretch, "23": -(x["near"] * stretch)}


def projection(formula: Formula, x: Columns) -> Columns:
    """Return the four numbers of a formula's projection that are neither 0 nor 1."""
    result = formula.function(x["horizontal"], x["vertical"], x["near"], x["far"])
    return {f"{i}{j}": result[i, j] for i, j in ((0, 0), (1, 1), (2, 2), (2, 3))}


def view(formula: Formula, x: Columns) -> Columns:
    """Return the translation in a formula's view matrix [m]."""
    result = formula.function(x["eye"], x["right"], x["up"], x["forward"])
    return {f"{i}3": result[i, 3] for i in range(3)}


def cornered(x: Columns) -> Columns:
    """Return the corners of the frustum [m]."""
    corners = []
    for depth, (sx, sy) in product((x["near"], x["far"]), ORDER):
        across, upwards = scaled(x["right"], sx * x["horizontal"]), scaled(x["up"], sy * x["vertical"])
        corners.append(plus(x["eye"], scaled(plus(plus(x["forward"], across), upwards), depth)))
    return numbered(corners)


def lights(x: Columns) -> list[Any]:
    """Return the contributions light0, light1, ..."""
    return [x[f"light{k}"] for k in range(sum(name.startswith("light") for name in x))]


def pi(like: Any) -> Any:
    """Return pi as a number of the type of `like`; its rounding error is treated like that of an input."""
    if isinstance(like, Bundle):
        with bits(WITNESS_BITS):
            return constant(arb.pi())
    return Conditioned(np.pi) if isinstance(like, Conditioned) else arb.pi()


ASKED: Mapping[str, ValueSlot] = {
    "sample": ValueSlot(
        exact=lambda x: {axis: (2 * x[axis] + 1) / (2 * x["per_side"]) for axis in ("column", "row")},
        ask=lambda formula, x: named("column", "row")(formula.function(x["column"], x["row"], x["per_side"])),
    ),
    "ndc": ValueSlot(
        exact=lambda x: {"sx": 2 * x["px"] / x["width"] - 1, "sy": 1 - 2 * x["py"] / x["height"]},
        ask=lambda formula, x: named("sx", "sy")(formula.function(x["px"], x["py"], x["width"], x["height"])),
    ),
    "pixel": ValueSlot(
        exact=lambda x: {"px": (x["sx"] + 1) * x["width"] / 2, "py": (1 - x["sy"]) * x["height"] / 2},
        ask=lambda formula, x: named("px", "py")(formula.function(x["sx"], x["sy"], x["width"], x["height"])),
    ),
    "projection": ValueSlot(exact=projected, ask=projection),
    "view": ValueSlot(
        exact=lambda x: {f"{i}3": -dot(x[axis], x["eye"]) for i, axis in enumerate(("right", "up", "forward"))},
        ask=view,
    ),
    "inverse": ValueSlot(exact=inverted, ask=inverse),
    "corners": ValueSlot(exact=cornered, ask=lambda formula, x: numbered(formula.function(SimpleNamespace(**x)))),
    "clip_depth": ValueSlot(
        exact=lambda x: {end: x[end] / dot(x["direction"], x["forward"]) for end in ("near", "far")},
        ask=lambda formula, x: named("near", "far")(
            formula.function(x["direction"], x["forward"], x["near"], x["far"])
        ),
    ),
    "sum_lights": ValueSlot(
        exact=lambda x: {"sum": sum(lights(x)[1:], lights(x)[0])},
        ask=lambda formula, x: {"sum": formula.function(lights(x))},
    ),
    "exitance": ValueSlot(
        exact=lambda x: numbered([[a * e for a, e in zip(x["albedo"], x["irradiance"], strict=True)]]),
        ask=lambda formula, x: numbered([formula.function(x["albedo"], x["irradiance"])]),
    ),
    "radiance": ValueSlot(
        exact=lambda x: {"L": x["exitance"] / pi(x["exitance"])},
        ask=lambda formula, x: {"L": formula.function(x["exitance"])},
    ),
    "radiance_simplified": ValueSlot(
        exact=lambda x: {"L": x["exitance"] * 1}, ask=lambda formula, x: {"L": formula.function(x["exitance"])}
    ),
}


@QUESTIONS.register("value")
class Value:
    """The numbers of the ladder's first slot."""

    def truth(self, ladder: Ladder, inputs: Inputs, rungs: np.ndarray) -> ExactAnswers:
        """Return the exact numbers and their weights K |X|."""
        exact = ASKED[ladder.slots[0]].exact
        numbers = evaluated(exact, inputs)
        witness = Witness(*witnessed(exact, inputs, numbers, sample(rungs)))
        with np.errstate(all="ignore"):
            weights = {name: number.weight for name, number in exact(parts(inputs, Conditioned)).items()}
        return ExactAnswers(counted=~nothing(len(rungs)), facts={"exact": numbers, "weights": weights}, witness=witness)

    def answer(self, ladder: Ladder, formula: Formula, inputs: Inputs, precision: str) -> Answer:
        """Return the formula's numbers."""
        numbers = ASKED[ladder.slots[0]].ask(formula, uploaded(inputs, array_types(precision)))
        return downloaded(numbers, len(next(iter(inputs.values()))))

    def grade(self, ladder: Ladder, inputs: Inputs, truth: ExactAnswers, answer: Answer, precision: str) -> Grades:
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
            # The error of a number is at least its own rounding, even if the number is mostly a constant.
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


# Special inputs: the result for a NaN or an infinity must be a miss or NaN, never a plausible number.
#
# A NaN distance is a miss, since no comparison finds it nearer. A subnormal t may be flushed to zero. False hits are: a
# finite or negative t although a number of the ray or shape is NaN or infinite; a unit direction from such a camera;
# light that is a number, black included, although an input is NaN. If the only special inputs are zeros of either sign,
# exact mathematics decides.


MATTERS = ("eye", "target", "up", "sx", "sy")  # inputs of a camera that affect a direction
MOST = 200  # rays in the sample of the second arithmetic


def impossible(values: Mathematics, inputs: Mapping[str, np.ndarray], mask: np.ndarray) -> Witness:
    """Return the check by ball arithmetic that the rays of a mask (rays,) have no finite answer.

    Every operation on a NaN ball gives a NaN ball. `values` are computed for a sample of the rays. If all values of a
    ray are finite, this contradicts the truth, and the distance from the truth is 1.
    """
    rays = np.flatnonzero(mask)
    chosen = rays[:: max(1, len(rays) // MOST)]
    worst = 0.0
    with bits(WITNESS_BITS):
        for ray in chosen:
            balls = values(single(inputs, int(ray), arb)).values()
            if all(ball.is_finite() for ball in balls):
                worst = 1.0
    return Witness(len(chosen), worst)


def dark(inputs: Mapping[str, np.ndarray]) -> Witness:
    """Return the check that no light arrives: each light is at its point, or not above the point's horizon."""
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
    """Return the mask of rays with only finite inputs; only the inputs `names` are tested, by default all."""
    columns = [inputs[name].reshape(len(inputs[name]), -1) for name in names or tuple(inputs)]
    return np.all(np.isfinite(np.concatenate(columns, axis=1)), axis=1)


def ordinary(inputs: Inputs) -> np.ndarray:
    """Return the mask of rays whose numbers are all zero or of moderate size."""
    columns = np.concatenate([array.reshape(len(array), -1) for array in inputs.values()], axis=1)
    with np.errstate(invalid="ignore"):
        return np.all((columns == 0) | ((abs(columns) > 1e-3) & (abs(columns) < 1e3)), axis=1)


def marks(counted: np.ndarray, plausible: np.ndarray, lost: np.ndarray, invalid: np.ndarray) -> Grades:
    """Return grades without errors."""
    unknown = np.full(len(counted), np.nan)
    return Grades(counted=counted, false_hit=plausible, false_miss=lost, invalid=invalid, error=unknown, index=unknown)


@QUESTIONS.register("special_distance")
class SpecialDistance:
    """The t of a shape for special inputs."""

    def truth(self, ladder: Ladder, inputs: Inputs, rungs: np.ndarray) -> ExactAnswers:
        """Return the masks of rays with finite inputs, with ordinary inputs, and with an exact hit of the latter."""
        plain = ordinary(inputs)
        kept = {name: array[plain] for name, array in inputs.items()}
        exact = Distance().truth(ladder, kept, rungs[plain])
        hit = nothing(len(plain))
        hit[plain] = exact.facts["hit"].hit
        # The t of the plane z = 0 depends only on z.
        numbers = inputs
        if ladder.options["shape"] == "plane":
            numbers = {name: array[:, 2] for name, array in inputs.items()}
        facts = {"finite": finite(numbers), "plain": plain, "hit": hit}
        columns = inputs | {"towards": towards(inputs["d"])} if ladder.options["shape"] == "cube" else inputs
        shape = SHAPES[str(ladder.options["shape"])]()
        # An infinite direction may have a limit; with a NaN neither the distance nor a decision has one.
        unknown = np.any([np.isnan(array.reshape(len(plain), -1)).any(axis=1) for array in numbers.values()], axis=0)
        none = impossible(lambda x: shape.values(x) | shape.predicates(x), columns, unknown)
        witness = Witness(exact.witness.values + none.values, max(exact.witness.worst, none.worst))
        return ExactAnswers(counted=~nothing(len(plain)), facts=facts, witness=witness)

    def answer(self, ladder: Ladder, formula: Formula, inputs: Inputs, precision: str) -> Answer:
        """Return t."""
        return Distance().answer(ladder, formula, inputs, precision)

    def grade(self, ladder: Ladder, inputs: Inputs, truth: ExactAnswers, answer: Answer, precision: str) -> Grades:
        """Return plausible answers to special inputs as false hits, and wrong answers to ordinary inputs."""
        t, facts = answer["t"], truth.facts
        hits = np.isfinite(t)
        negative = t < 0
        plausible = (hits & ~facts["finite"]) | negative | (hits & facts["plain"] & ~facts["hit"])
        return marks(truth.counted, plausible, ~hits & facts["hit"], nothing(len(t)))


@QUESTIONS.register("special_camera")
class SpecialCamera:
    """The direction of a view ray for special inputs."""

    def truth(self, ladder: Ladder, inputs: Inputs, rungs: np.ndarray) -> ExactAnswers:
        """Return the rays of cameras with a number that is not finite as the counted rays."""
        valid = finite(inputs, MATTERS)
        high, low = tangents(inputs["fovy"])
        numbers = {name: inputs[name] for name in (*MATTERS, "aspect")} | {"tangent": high, "tangent_rest": low}
        return ExactAnswers(counted=~valid, facts={}, witness=impossible(looking, numbers, ~valid))

    def answer(self, ladder: Ladder, formula: Formula, inputs: Inputs, precision: str) -> Answer:
        """Return directions."""
        return ViewRay().answer(ladder, formula, inputs, precision)

    def grade(self, ladder: Ladder, inputs: Inputs, truth: ExactAnswers, answer: Answer, precision: str) -> Grades:
        """Return plausible directions as false hits."""
        length = np.linalg.norm(answer["d"], axis=1)
        plausible = truth.counted & (abs(length - 1) < 0.5)
        return marks(truth.counted, plausible, nothing(len(length)), nothing(len(length)))


def brought(formula: Formula, x: Columns, precision: str) -> Columns:
    """Return the irradiance of one light by a formula and the defaults of the other slots."""
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
    """Return Phi dot(N, L) / (4 pi r^2), without special cases."""
    squared = dot(x["away"], x["away"])
    return {"E": x["flux"] * dot(x["normal"], x["away"]) / (4 * arb.pi() * squared * squared.sqrt())}


@QUESTIONS.register("special_light")
class SpecialLight:
    """The irradiance of one light for inputs with NaN."""

    def truth(self, ladder: Ladder, inputs: Inputs, rungs: np.ndarray) -> ExactAnswers:
        """Return the rays whose result must be NaN: the geometry is, or the flux of a light above the horizon is."""
        nowhere = np.any(np.isnan(inputs["normal"]) | np.isnan(inputs["away"]), axis=1)
        with np.errstate(all="ignore"):
            # The sign of the dot product is certain only for inputs of moderate size.
            usual = np.all(abs(inputs["normal"]) < 2, axis=1) & np.all(abs(inputs["away"]) < 10, axis=1)
            above = usual & (np.sum(inputs["normal"] * inputs["away"], axis=1) > 0.01)
        counted = nowhere | (np.isnan(inputs["flux"]) & above)
        return ExactAnswers(counted=counted, facts={}, witness=impossible(lit, inputs, counted))

    def answer(self, ladder: Ladder, formula: Formula, inputs: Inputs, precision: str) -> Answer:
        """Return the irradiance."""
        x = uploaded(inputs, array_types(precision))
        return downloaded(brought(formula, x, precision), len(inputs["flux"]))

    def grade(self, ladder: Ladder, inputs: Inputs, truth: ExactAnswers, answer: Answer, precision: str) -> Grades:
        """Return numbers in place of NaN as false hits."""
        none = nothing(len(answer["E"]))
        return marks(truth.counted, truth.counted & ~np.isnan(answer["E"]), none, none)


@QUESTIONS.register("dark_light")
class DarkLight:
    """The irradiance of a light without effect: exactly at the point, behind the surface, or exactly on the horizon."""

    def truth(self, ladder: Ladder, inputs: Inputs, rungs: np.ndarray) -> ExactAnswers:
        """Return all rays as counted: the generator makes only such lights, by zeros and signs."""
        return ExactAnswers(counted=~nothing(len(rungs)), facts={}, witness=dark(inputs))

    def answer(self, ladder: Ladder, formula: Formula, inputs: Inputs, precision: str) -> Answer:
        """Return the irradiance."""
        x = uploaded(inputs, array_types(precision))
        return downloaded(brought(formula, x, precision), len(inputs["flux"]))

    def grade(self, ladder: Ladder, inputs: Inputs, truth: ExactAnswers, answer: Answer, precision: str) -> Grades:
        """Return a nonzero irradiance as a false hit, and NaN as invalid."""
        value = answer["E"]
        return marks(truth.counted, ~np.isnan(value) & (value != 0), nothing(len(value)), np.isnan(value))
