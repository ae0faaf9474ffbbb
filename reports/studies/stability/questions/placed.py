"""Questions of ray and shape: the t of a hit (also with a matrix or baked), the order of two hits, placed normals."""

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import drjit as dr
import numpy as np

from rayproof.cases.ladders import Inputs, Ladder
from rayproof.cases.placement import world_triangles
from rayproof.cases.rounding import UNIT_ROUNDOFF
from rayproof.cases.scene import Cube, Mesh, Plane, Shape, Sphere, Square
from rayproof.reference.certified.bundles import Bundle, floats
from rayproof.reference.certified.columns import Columns, confirmed, decided, evaluated, parts, witnessed
from rayproof.reference.certified.meetings import SHAPES, ExactHit, ExactTriangle, towards
from rayproof.reference.certified.numbers import cross, dot, minus, unit
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
from rayproof.reports.studies.stability.shapes import ahead, ray_of, record
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.formulas import Formula
from rayproof.tracer.kernel.arrays import ArrayTypes, array_types
from rayproof.tracer.shapes.primitives import traced
from rayproof.tracer.shapes.shape import Transform

LENGTHS = {"sphere": ("o", "c", "r"), "triangle": ("o", "a", "b", "c")}


def exponents(inputs: Inputs, names: tuple[str, ...]) -> np.ndarray:
    """Return per ray the binary exponent of the largest absolute number among the inputs `names`."""
    columns = [inputs[name].reshape(len(inputs[name]), -1) for name in names]
    return np.frexp(abs(np.concatenate(columns, axis=1)).max(axis=1))[1]


def rescaled(inputs: Inputs, shape: str) -> tuple[Inputs, np.ndarray]:
    """Return inputs scaled by powers of two to size one, so that pairs do not overflow, and log2 of the scale of t."""
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
    """The t of the nearest hit in front of the ray's origin, inf for a miss."""

    def truth(self, ladder: Ladder, inputs: Inputs, rungs: np.ndarray) -> ExactAnswers:
        """Return hit and t; a ray whose hit has no finite t in pairs is not counted."""
        name = str(ladder.options["shape"])
        shape = SHAPES[name]()
        numbers, shift = rescaled(inputs, name) if name in LENGTHS else (inputs, np.zeros(len(rungs), dtype=int))
        if name == "cube":
            numbers = numbers | {"towards": towards(numbers["d"])}
        signs, values = decided(shape.predicates, numbers), evaluated(shape.values, numbers)
        hit = shape.decide(signs, values, numbers)
        witness = Witness(*witnessed(shape.values, numbers, values, sample(rungs)))
        counted = ~(hit.hit & ~np.isfinite(hit.t.high))
        return ExactAnswers(
            counted=counted, facts={"hit": hit, "given": numbers, "shift": shift, "shape": shape}, witness=witness
        )

    def answer(self, ladder: Ladder, formula: Formula, inputs: Inputs, precision: str) -> Answer:
        """Return t per ray."""
        types = array_types(precision)
        columns = uploaded(inputs, types)
        shape = record(str(ladder.options["shape"]), columns, types)
        return downloaded({"t": formula.function(ray_of(columns), shape, ahead(types))}, len(inputs["o"]))

    def grade(self, ladder: Ladder, inputs: Inputs, truth: ExactAnswers, answer: Answer, precision: str) -> Grades:
        """Return false hits, false misses and errors; only rays with a hit in truth and answer have an error."""
        return graded(ladder, truth, answer["t"], precision)


def graded(ladder: Ladder, truth: ExactAnswers, t: np.ndarray, precision: str) -> Grades:
    """Return the grades of answers `t`."""
    hit: ExactHit = truth.facts["hit"]
    numbers, u = truth.facts["given"], UNIT_ROUNDOFF[precision]
    hits = np.isfinite(t)
    hits_in_both = hits & hit.hit & truth.counted
    with np.errstate(all="ignore"):
        off = np.where(hits_in_both, abs((hit.t - floats(np.ldexp(t, truth.facts["shift"]))).high), np.nan)
        center = numbers[truth.facts["shape"].center] if truth.facts["shape"].center else 0.0
        reach = abs(numbers["o"] - center) + abs(hit.t.high[:, None] * numbers["d"])
        weight = np.sum(abs(hit.normal) * reach, axis=1) + hit.size
        slope = abs(np.sum(hit.normal * numbers["d"], axis=1))
        index = off * slope / (u * weight)
        error = off / natural(ladder, numbers, hit.t, u)
    return Grades(
        counted=truth.counted,
        false_hit=hits & ~hit.hit & truth.counted,
        false_miss=~hits & hit.hit & truth.counted,
        invalid=(np.isnan(t) & truth.counted) if t.size else nothing(0),
        error=error,
        index=index,
    )


def natural(ladder: Ladder, numbers: Inputs, t: Bundle, u: float) -> Any:
    """Return the divisor of an error of t: a sphere's radius over |d| (radii), |t| (relative), or |t| u (roundings)."""
    match ladder.options.get("natural", "roundings"):
        case "radii":
            return numbers["r"] / np.linalg.norm(numbers["d"], axis=1)
        case "relative":
            return abs(t.high)
        case _:
            return abs(t.high) * u


# Formulas that use a model matrix: rays into object space, squares in world space, normals back to world space.
#
# A matrix is a literal in the tracer, so a ladder has a few matrices per value, each for a block of the rays; all
# blocks are still computed in one kernel. The truth takes the matrix's numbers as exact. Inputs: matrix (rays, 12), row
# by row without the last row, the same for a whole block of rays; o and d, or n.


ALBEDO = (0.5, 0.5, 0.5)
MADE: dict[str, Callable[[Any], Shape]] = {
    "sphere": lambda matrix: Sphere(center=(0.0, 0.0, 0.0), radius=1.0, albedo=ALBEDO, to_world=matrix),
    "cube": lambda matrix: Cube(albedo=ALBEDO, to_world=matrix),
    "plane": lambda matrix: Plane(albedo=ALBEDO, to_world=matrix),
    "square": lambda matrix: Square(albedo=ALBEDO, to_world=matrix),
}


def rows(flat: np.ndarray) -> Any:
    """Return a 4x4 matrix as tuples from its first three rows (twelve numbers); the last row is (0, 0, 0, 1)."""
    return (*(tuple(map(float, row)) for row in np.reshape(flat, (3, 4))), (0.0, 0.0, 0.0, 1.0))


def blocks(inputs: Inputs) -> list[slice]:
    """Return the slices of rays with the same matrix."""
    change = np.any(inputs["matrix"][1:] != inputs["matrix"][:-1], axis=1)
    edges = [0, *(np.flatnonzero(change) + 1).tolist(), len(inputs["matrix"])]
    return [slice(a, b) for a, b in pairwise(edges)]


def inverse(x: Columns) -> tuple[Any, Any]:
    """Return the rows of the inverse 3x3 part and the translation, by cofactors; exact for rationals."""
    m = x["matrix"]
    first, second, third = ((m[0], m[4], m[8]), (m[1], m[5], m[9]), (m[2], m[6], m[10]))  # columns
    by = (cross(second, third), cross(third, first), cross(first, second))
    det = dot(first, by[0])
    return tuple(tuple(c / det for c in row) for row in by), (m[3], m[7], m[11])


def in_object_space(x: Columns) -> Columns:
    """Return the ray in object space."""
    inverse_rows, origin = inverse(x)
    moved = minus(x["o"], origin)
    return {"o": tuple(dot(row, moved) for row in inverse_rows), "d": tuple(dot(row, x["d"]) for row in inverse_rows)}


@QUESTIONS.register("placed_distance")
class PlacedDistance:
    """The t of a placed shape, by the slot's variant and the defaults of all other slots."""

    def truth(self, ladder: Ladder, inputs: Inputs, rungs: np.ndarray) -> ExactAnswers:
        """Return hit and t of the exact object-space ray."""
        name = str(ladder.options["shape"])
        shape = SHAPES[name]()

        def whole(mathematics: Callable[[Columns], Columns]) -> Callable[[Columns], Columns]:
            def from_world(x: Columns) -> Columns:
                local: Columns = in_object_space(x)
                local["c"], local["r"] = (0, 0, 0), 1
                return mathematics(local | ({"towards": x["towards"]} if name == "cube" else {}))

            return from_world

        inputs = dict(inputs)
        moved = evaluated(
            lambda x: {f"{k}{i}": v for k, t in in_object_space(x).items() for i, v in enumerate(t)}, inputs
        )
        numbers = {k: np.stack([moved[f"{k}{i}"].high for i in range(3)], axis=1) for k in "od"}
        numbers |= {"c": np.zeros_like(numbers["o"]), "r": np.ones(len(rungs))}
        if name == "cube":
            inputs["towards"] = towards(numbers["d"])
        predicates, values = whole(shape.predicates), whole(shape.values)
        signs, exact = decided(predicates, inputs), evaluated(values, inputs)
        hit = shape.decide(signs, exact, numbers)
        witness = Witness(*witnessed(values, inputs, exact, sample(rungs)))
        facts = {"hit": hit, "given": numbers, "shift": np.zeros(len(rungs), dtype=int), "shape": shape}
        return ExactAnswers(counted=~(hit.hit & ~np.isfinite(hit.t.high)), facts=facts, witness=witness)

    def answer(self, ladder: Ladder, formula: Formula, inputs: Inputs, precision: str) -> Answer:
        """Return t per ray, all matrices in one kernel."""
        types = array_types(precision)
        configuration = Configuration(precision=precision, formulas={formula.slot: formula.variant})
        parts = [self._block(ladder, configuration, inputs, block, types) for block in blocks(inputs)]
        dr.eval(parts)
        return {"t": np.concatenate([np.array(part, dtype=np.float64) for part in parts])}

    def _block(
        self, ladder: Ladder, configuration: Configuration, inputs: Inputs, block: slice, types: ArrayTypes
    ) -> Any:
        matrix = rows(inputs["matrix"][block.start])
        shape = traced(MADE[str(ladder.options["shape"])](matrix))
        intersect = configuration.formula(shape.slot)
        ray = ray_of(uploaded({name: inputs[name][block] for name in "od"}, types))
        if intersect.facts.get("space") == "object":
            ray = configuration["to_object"](ray, shape.transform)
        return intersect.function(ray, shape.arrays(types), ahead(types))

    def grade(self, ladder: Ladder, inputs: Inputs, truth: ExactAnswers, answer: Answer, precision: str) -> Grades:
        """Return false hits, false misses and errors."""
        return graded(ladder, truth, answer["t"], precision)


@QUESTIONS.register("placed_normal")
class PlacedNormal:
    """A unit normal transformed from object to world space: its angle to the normal by the exact inverse transpose."""

    def truth(self, ladder: Ladder, inputs: Inputs, rungs: np.ndarray) -> ExactAnswers:
        """Return the exact unit normal and the condition number of the matrix."""

        def normals(x: Columns) -> Columns:
            by, _ = inverse(x)
            n = x["n"]
            # The inverse's columns are the rows of its transpose
            turned = unit(tuple(by[0][i] * n[0] + by[1][i] * n[1] + by[2][i] * n[2] for i in range(3)))
            return {f"n{i}": value for i, value in enumerate(turned)}

        exact = evaluated(normals, inputs)
        witness = Witness(*witnessed(normals, inputs, exact, sample(rungs)))
        linear = inputs["matrix"].reshape(-1, 3, 4)[:, :, :3]
        condition = np.linalg.cond(linear)
        return ExactAnswers(
            counted=np.ones(len(rungs), dtype=bool), facts={"n": exact, "K": condition}, witness=witness
        )

    def answer(self, ladder: Ladder, formula: Formula, inputs: Inputs, precision: str) -> Answer:
        """Return world normals, all matrices in one kernel."""
        types = array_types(precision)
        parts = []
        for block in blocks(inputs):
            normal = uploaded({"n": inputs["n"][block]}, types)["n"]
            parts.append(formula.function(normal, Transform(to_world=rows(inputs["matrix"][block.start]))))
        dr.eval(parts)
        return {"n": np.concatenate([np.array(part, dtype=np.float64).T for part in parts])}

    def grade(self, ladder: Ladder, inputs: Inputs, truth: ExactAnswers, answer: Answer, precision: str) -> Grades:
        """Return angles in degrees, and in K u radians with K = cond(M)."""
        # A normal that is not a unit vector scales the light, so the error of its length counts like an angle.
        angle = np.maximum(angles(answer["n"], truth.facts["n"]), abs(np.linalg.norm(answer["n"], axis=1) - 1))
        invalid = ~np.isfinite(angle)
        return Grades(
            counted=truth.counted,
            false_hit=nothing(len(angle)),
            false_miss=nothing(len(angle)),
            invalid=invalid,
            error=np.degrees(angle),
            index=angle / (truth.facts["K"] * UNIT_ROUNDOFF[precision]),
        )


def angles(computed: np.ndarray, exact: Columns) -> np.ndarray:
    """Return the angle [rad] between computed vectors and exact unit vectors n0, n1, n2, by atan2."""
    true, vector = tuple(exact[f"n{i}"] for i in range(3)), parts({"n": computed}, floats)["n"]
    with np.errstate(all="ignore"):
        across = np.sqrt(sum(component.high**2 for component in cross(true, vector)))
        return np.arctan2(across, dot(true, vector).high)


def in_world_space(x: Columns) -> Columns:
    """Return the ray, and the triangle in world space."""
    m = x["matrix"]

    def placed(corner: Any) -> Any:
        return tuple(
            m[4 * i] * corner[0] + m[4 * i + 1] * corner[1] + m[4 * i + 2] * corner[2] + m[4 * i + 3] for i in range(3)
        )

    return {"o": x["o"], "d": x["d"]} | {name: placed(x[name]) for name in "abc"}


class Baked(ExactTriangle):
    """A triangle with corners rounded in world space: K weighs corners and ray by their distance from the origin."""

    center = None


@QUESTIONS.register("baked_distance")
class BakedDistance:
    """The t of a triangle that was baked into world space; its corners there are float32 in either precision.

    The truth takes the exact corners, without that rounding.
    """

    def truth(self, ladder: Ladder, inputs: Inputs, rungs: np.ndarray) -> ExactAnswers:
        """Return hit and t of the exact corners."""
        shape = Baked()
        signs = decided(lambda x: shape.predicates(in_world_space(x)), inputs)

        def values(x: Columns) -> Columns:
            return shape.values(in_world_space(x))

        exact = evaluated(values, inputs)
        world = evaluated(
            lambda x: {f"{name}{i}": v for name in "abc" for i, v in enumerate(in_world_space(x)[name])}, inputs
        )
        numbers = {name: np.stack([world[f"{name}{i}"].high for i in range(3)], axis=1) for name in "abc"}
        numbers |= {"o": inputs["o"], "d": inputs["d"]}
        hit = shape.decide(signs, exact, numbers)
        facts = {"hit": hit, "given": numbers, "shift": np.zeros(len(rungs), dtype=int), "shape": shape}
        witness = Witness(*witnessed(values, inputs, exact, sample(rungs)))
        return ExactAnswers(counted=~(hit.hit & ~np.isfinite(hit.t.high)), facts=facts, witness=witness)

    def answer(self, ladder: Ladder, formula: Formula, inputs: Inputs, precision: str) -> Answer:
        """Return t per ray, all triangles in one kernel."""
        corners = np.concatenate([_baked(inputs, block) for block in blocks(inputs)])
        numbers = inputs | {name: corners[:, i].astype(np.float64) for i, name in enumerate("abc")}
        columns = uploaded({name: numbers[name] for name in "odabc"}, array_types(precision))
        t = formula.function(
            ray_of(columns), record("triangle", columns, array_types(precision)), ahead(array_types(precision))
        )
        return downloaded({"t": t}, len(corners))

    def grade(self, ladder: Ladder, inputs: Inputs, truth: ExactAnswers, answer: Answer, precision: str) -> Grades:
        """Return misses and errors, in roundings of float32 in every precision, as the corners are float32."""
        return graded(ladder, truth, answer["t"], "float32")


def _baked(inputs: Inputs, block: slice) -> np.ndarray:
    """Return the world-space corners (rays, 3, 3) of triangles with the same matrix, as every renderer gets them."""
    corners = np.stack([inputs[name][block] for name in "abc"], axis=1)
    faces = np.arange(3 * len(corners)).reshape(-1, 3)
    matrix = rows(inputs["matrix"][block.start])
    return world_triangles(Mesh(vertices=corners.reshape(-1, 3), faces=faces, albedo=ALBEDO, to_world=matrix))


# Which of two surfaces is nearer? Two parallel triangles a small gap apart, intersected one after the other.
#
# The truth compares the exact t of both by Cramer's rule without a division; a ray counts if it hits both triangles. It
# is a false hit to take the second triangle although it is farther, and a false miss to pass it over although it is
# nearer. Inputs: o, d, the first triangle a, b, c and the second triangle a2, b2, c2.


TRIANGLE = ExactTriangle()


def second(x: Columns) -> Columns:
    """Return the ray with the second triangle as a, b, c."""
    return x | {name: x[f"{name}2"] for name in "abc"}


def compared(x: Columns) -> Columns:
    """Return the predicates of both triangles, and `later` = t1 det1 det2 - t2 det1 det2 for the exact t1 and t2."""
    first_predicates, second_predicates = TRIANGLE.predicates(x), TRIANGLE.predicates(second(x))
    later = first_predicates["t"] * second_predicates["det"] - second_predicates["t"] * first_predicates["det"]
    return first_predicates | {f"{name}2": value for name, value in second_predicates.items()} | {"later": later}


@QUESTIONS.register("order")
class Order:
    """The slots `nearest` and `triangle`, each with the default of the other."""

    def truth(self, ladder: Ladder, inputs: Inputs, rungs: np.ndarray) -> ExactAnswers:
        """Return the rays that hit both triangles, and the mask of rays for which the second is nearer."""
        signs = decided(compared, inputs)
        witness = Witness(*confirmed(compared, inputs, signs, sample(rungs)))
        hits = TRIANGLE.met(signs) & TRIANGLE.met({name: signs[f"{name}2"] for name in ("det", "u", "v", "w", "t")})
        later = signs["later"].astype(int) * signs["det"] * signs["det2"]
        return ExactAnswers(counted=hits, facts={"second": later > 0}, witness=witness)

    def answer(self, ladder: Ladder, formula: Formula, inputs: Inputs, precision: str) -> Answer:
        """Return 1 if the second triangle is taken, else 0."""
        types = array_types(precision)
        configuration = Configuration(precision=precision, formulas={formula.slot: formula.variant})
        x = uploaded(inputs, types)
        best, t = (
            configuration["triangle"](ray_of(x), record("triangle", columns, types), ahead(types))
            for columns in (x, second(x))
        )
        return downloaded({"second": types.Float(configuration["nearest"](t, best))}, len(inputs["o"]))

    def grade(self, ladder: Ladder, inputs: Inputs, truth: ExactAnswers, answer: Answer, precision: str) -> Grades:
        """Return wrong orders."""
        answered, right = answer["second"] > 0, truth.facts["second"]
        unknown = np.full(len(answered), np.nan)
        return Grades(
            counted=truth.counted,
            false_hit=answered & ~right & truth.counted,
            false_miss=~answered & right & truth.counted,
            invalid=np.zeros(len(answered), dtype=bool),
            error=unknown,
            index=unknown,
        )
