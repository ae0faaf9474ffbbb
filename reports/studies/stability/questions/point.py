"""The point on a shape and its normal: how far the point lies off the true surface, how the normal turns away.

Inputs as for "distance" with that shape; the distance is the default formula's, so what differs is the point alone.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from rayproof.cases.ladders import Inputs, Ladder
from rayproof.cases.rounding import UNIT_ROUNDOFF
from rayproof.reports.studies.stability.bounded_pairs import Pair
from rayproof.reports.studies.stability.device import downloaded, uploaded
from rayproof.reports.studies.stability.exactly import Columns, decided, evaluated, sample, witnessed
from rayproof.reports.studies.stability.geometry import ahead, ray_of, record
from rayproof.reports.studies.stability.mathematics import cross, dot, minus, normalized
from rayproof.reports.studies.stability.questions import QUESTIONS, Answer, Grades, Truth, Witness, nothing
from rayproof.reports.studies.stability.questions.distance import Distance
from rayproof.reports.studies.stability.questions.placed import angles
from rayproof.tracer.formulas import FORMULAS, Formula
from rayproof.tracer.kernel.arrays import array_types
from rayproof.tracer.rays import Ray


@dataclass(frozen=True, kw_only=True)
class InPlace:
    """What a position formula may ask, where object space is world space and `everywhere` says that all are spheres."""

    ray: Ray
    center: Any
    radius: Any
    everywhere: Any

    def __call__(self) -> tuple[Ray, Callable[[Any], Any]]:
        """Return the ray, which is already in object space, and what takes points to world space: nothing."""
        return self.ray, lambda point: point

    def spheres(self) -> tuple[Any, Any, Any]:
        """Return that all are spheres, the centre and the radius [m]."""
        return self.everywhere, self.center, self.radius


def off_surface(shape: str, p: np.ndarray, x: Inputs) -> np.ndarray:
    """Return the distance [m] of points (rays, 3) from the true surface."""
    if shape == "plane":
        return abs(p[:, 2])
    at = tuple(Pair(p[:, i]) for i in range(3))
    if shape == "sphere":
        local = minus(at, tuple(x["c"].T))
        return abs(dot(local, local).sqrt().minus(x["r"]))
    a, b, c = (tuple(Pair(x[name][:, i]) for i in range(3)) for name in "abc")
    normal = normalized(cross(minus(b, a), minus(c, a)))
    return abs(dot(normal, minus(at, a)).high)


def rounding(shape: str, x: Inputs, t: np.ndarray) -> np.ndarray:
    """Return what K u multiplies [m]: a sphere's own numbers, or what the ray's components along the normal sum up to.

    A point on a sphere can be as near as its own rounding, since the sphere's numbers are larger than zero. Of a flat
    shape whose numbers may all be zero only the way to it is left, o and t d.
    """
    if shape == "sphere":
        return np.linalg.norm(x["c"], axis=1) + x["r"]
    reach = abs(x["o"]) + abs(t[:, None] * x["d"])
    if shape == "plane":
        return reach[:, 2]
    normal = np.cross(x["b"] - x["a"], x["c"] - x["a"])
    return np.sum(abs(normal) * (reach + abs(x["a"])), axis=1) / np.linalg.norm(normal, axis=1)


@QUESTIONS.register("point")
class Point:
    """The slot `position`: the distance of the computed point from the surface, on a sphere in radii."""

    def truth(self, ladder: Ladder, inputs: Inputs, rungs: np.ndarray) -> Truth:
        """Return which rays hit."""
        whole = Distance().truth(ladder, inputs, rungs)
        return Truth(counted=whole.counted & whole.facts["hit"].hit, facts={}, witness=whole.witness)

    def answer(self, ladder: Ladder, formula: Formula, inputs: Inputs, precision: str) -> Answer:
        """Return points [m]."""
        types, shape = array_types(precision), str(ladder.options["shape"])
        columns = uploaded(inputs, types)
        ray = ray_of(columns)
        t = FORMULAS[f"{shape}/{FORMULAS.slots[shape]}"].function(ray, record(shape, columns, types), ahead(types))
        place = InPlace(
            ray=ray,
            center=columns.get("c", types.Vector(0.0)),
            radius=columns.get("r", types.Float(1.0)),
            everywhere=types.Bool(shape == "sphere"),
        )
        return downloaded({"p": formula.function(ray, t, place), "t": t}, len(inputs["o"]))

    def grade(self, ladder: Ladder, inputs: Inputs, truth: Truth, answer: Answer, precision: str) -> Grades:
        """Return distances from the surface; a ray that the default formula lost is not the point's fault."""
        shape = str(ladder.options["shape"])
        counted = truth.counted & np.isfinite(answer["t"])
        with np.errstate(all="ignore"):
            off = np.where(counted, off_surface(shape, answer["p"], inputs), np.nan)
            index = off / (UNIT_ROUNDOFF[precision] * rounding(shape, inputs, answer["t"]))
        rays = len(off)
        return Grades(
            counted=counted,
            false_hit=nothing(rays),
            false_miss=nothing(rays),
            invalid=counted & np.isnan(off),
            error=off / inputs["r"] if shape == "sphere" else off,
            index=index,
        )


@QUESTIONS.register("sphere_normal")
class SphereNormal:
    """The slot `sphere_normal`: inputs p and c; the angle to the exact direction from c to p. K = 1."""

    def truth(self, ladder: Ladder, inputs: Inputs, rungs: np.ndarray) -> Truth:
        """Return the exact unit normal."""

        def outward(x: Columns) -> Columns:
            return {f"n{i}": value for i, value in enumerate(normalized(minus(x["p"], x["c"])))}

        found = evaluated(outward, inputs)
        witness = Witness(*witnessed(outward, inputs, found, sample(rungs)))
        return Truth(counted=~nothing(len(rungs)), facts={"n": found}, witness=witness)

    def answer(self, ladder: Ladder, formula: Formula, inputs: Inputs, precision: str) -> Answer:
        """Return normals."""
        columns = uploaded(inputs, array_types(precision))
        return downloaded({"n": formula.function(columns["p"], columns["c"])}, len(inputs["p"]))

    def grade(self, ladder: Ladder, inputs: Inputs, truth: Truth, answer: Answer, precision: str) -> Grades:
        """Return angles in degrees."""
        angle = angles(answer["n"], truth.facts["n"])
        none = nothing(len(angle))
        return Grades(
            counted=truth.counted,
            false_hit=none,
            false_miss=none,
            invalid=~np.isfinite(angle),
            error=np.degrees(angle),
            index=angle / UNIT_ROUNDOFF[precision],
        )


@QUESTIONS.register("facing")
class Facing:
    """The slot `facing`: inputs n and d; a normal turned to the wrong side counts as a false hit."""

    def truth(self, ladder: Ladder, inputs: Inputs, rungs: np.ndarray) -> Truth:
        """Return the sign of n . d; exact right angles are not counted."""
        sign = decided(lambda x: {"side": dot(x["n"], x["d"])}, inputs)["side"]
        return Truth(counted=sign != 0, facts={"side": sign}, witness=Witness(len(sign), 0.0))

    def answer(self, ladder: Ladder, formula: Formula, inputs: Inputs, precision: str) -> Answer:
        """Return the turned normals."""
        columns = uploaded(inputs, array_types(precision))
        return downloaded({"n": formula.function(columns["n"], columns["d"])}, len(inputs["n"]))

    def grade(self, ladder: Ladder, inputs: Inputs, truth: Truth, answer: Answer, precision: str) -> Grades:
        """Return wrong sides."""
        right = np.where((truth.facts["side"] > 0)[:, None], -inputs["n"], inputs["n"])
        wrong = np.any(answer["n"] != right, axis=1) & truth.counted
        unknown = np.full(len(wrong), np.nan)
        return Grades(
            counted=truth.counted,
            false_hit=wrong,
            false_miss=nothing(len(wrong)),
            invalid=np.any(np.isnan(answer["n"]), axis=1),
            error=unknown,
            index=unknown,
        )
