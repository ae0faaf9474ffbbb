"""Questions of leaks: the number of triangles that a ray through a fan hits, and the face of a cube that it hits.

A fan is the triangles around the edge or vertex that the ray is aimed at. A ray is counted only if it is inside all
outer edges of the fan in float64, with a margin far larger than the rounding, and all triangles face it. Then it
pierces the fan regardless of the decisions at the inner edges. Silhouettes are not counted, because there a ray may
rightly miss all triangles.
"""

import drjit as dr
import numpy as np

from rayproof.cases.ladders import Inputs, Ladder
from rayproof.reference.certified.columns import Columns, single
from rayproof.reference.certified.fields import exact
from rayproof.reference.certified.numbers import cross, dot, minus
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
from rayproof.reports.studies.stability.shapes import ahead, ray_of, record
from rayproof.tracer.formulas import FORMULAS, Formula
from rayproof.tracer.kernel.arrays import array_types
from rayproof.tracer.shapes.meshes import TriangleArrays

MARGIN = 1e-6  # relative to the lengths in an edge function


def fans(ladder: Ladder) -> tuple[tuple[int, int, int], ...]:
    """Return the triangles of a fan as indices into its corners, all with the same winding."""
    if ladder.options["fan"] == "edge":
        return (0, 1, 2), (1, 0, 3)
    return tuple((0, 1 + i, 1 + (i + 1) % 6) for i in range(6))


def rim(ladder: Ladder) -> tuple[tuple[int, int], ...]:
    """Return the outer edges of a fan, with the winding of its triangles."""
    if ladder.options["fan"] == "edge":
        return (1, 2), (2, 0), (0, 3), (3, 1)
    return tuple((1 + i, 1 + (i + 1) % 6) for i in range(6))


@QUESTIONS.register("watertight")
class Watertight:
    """The number of triangles of a fan that a ray hits. Inputs: the corners p0, p1, ..., and the ray o, d."""

    def truth(self, ladder: Ladder, inputs: Inputs, rungs: np.ndarray) -> ExactAnswers:
        """Return exact answers that count only rays which certainly hit the fan; rationals confirm a sample."""
        corners = {name: inputs[name] - inputs["o"] for name in inputs if name.startswith("p")}
        sides = [_side(corners, inputs["d"], edge) for edge in rim(ladder)]
        facing = [
            np.sum(
                np.cross(corners[f"p{b}"] - corners[f"p{a}"], corners[f"p{c}"] - corners[f"p{a}"]) * inputs["d"], axis=1
            )
            for a, b, c in fans(ladder)
        ]
        length = np.linalg.norm(corners["p1"] - corners["p0"], axis=1)
        forward = np.sign(facing[0])
        with np.errstate(all="ignore"):
            margin = MARGIN * length * np.linalg.norm(corners["p0"], axis=1)
            clear = np.all([side * forward > margin for side in sides], axis=0)
            clear &= np.all([face * forward > MARGIN * length**2 for face in facing], axis=0)
        return ExactAnswers(counted=clear, facts={}, witness=self._witness(ladder, inputs, rungs, clear))

    def _witness(self, ladder: Ladder, inputs: Inputs, rungs: np.ndarray, clear: np.ndarray) -> Witness:
        """Confirm by rationals that some triangle of the fan is pierced, edges included."""
        checked, wrong = 0, 0
        for ray in sample(rungs):
            if not clear[ray]:
                continue
            x = single(inputs, int(ray), exact)
            checked += 1
            wrong += not any(_pierced(x, triangle) for triangle in fans(ladder))
        return Witness(checked, float(wrong))

    def answer(self, ladder: Ladder, formula: Formula, inputs: Inputs, precision: str) -> Answer:
        """Return the number of hit triangles, by one launch of the same kernel per value."""
        types = array_types(precision)
        rays = len(inputs["o"])
        chunk = max(1, rays // len(ladder.values))
        counts = []
        for start in range(0, rays, chunk):
            part = {name: array[start : start + chunk] for name, array in inputs.items()}
            columns = uploaded(part, types)
            hits = types.Float(0.0)
            for a, b, c in fans(ladder):
                triangle = TriangleArrays(first=columns[f"p{a}"], second=columns[f"p{b}"], third=columns[f"p{c}"])
                t = formula.function(ray_of(columns), triangle, ahead(types))
                hits += dr.select(t < dr.inf, types.Float(1.0), 0.0)
            counts.append(downloaded({"found": hits}, len(part["o"]))["found"])
        return {"found": np.concatenate(counts)}

    def grade(self, ladder: Ladder, inputs: Inputs, truth: ExactAnswers, answer: Answer, precision: str) -> Grades:
        """Return leaks as false misses, and the additional count of double hits."""
        rays = len(inputs["o"])
        unknown = np.full(rays, np.nan)
        return Grades(
            counted=truth.counted,
            false_hit=nothing(rays),
            false_miss=truth.counted & (answer["found"] == 0),
            invalid=nothing(rays),
            error=unknown,
            index=unknown,
            counts={"double_hits": truth.counted & (answer["found"] > 1)},
        )


def _pierced(x: Columns, triangle: tuple[int, int, int]) -> bool:
    a, b, c = (minus(x[f"p{i}"], x["o"]) for i in triangle)
    sides = [dot(cross(p, q), x["d"]) for p, q in ((a, b), (b, c), (c, a))]
    return all(side >= 0 for side in sides) or all(side <= 0 for side in sides)


def _side(corners: Inputs, d: np.ndarray, edge: tuple[int, int]) -> np.ndarray:
    """Return the edge function of an edge for rays d; inside it has the sign of dot(normal, direction).

    `corners` are relative to the ray's origin.
    """
    return np.sum(np.cross(corners[f"p{edge[0]}"], corners[f"p{edge[1]}"]) * d, axis=1)


# Which face of the cube did the ray hit? The answer takes slabs, point and normal. A wrong face counts as a false hit.
#
# Truth: the face that the exact ray enters last or leaves first; ties, where it hits an edge, are not counted.


@QUESTIONS.register("face")
class Face:
    """The outward axis at the nearest hit, by the default slabs."""

    def truth(self, ladder: Ladder, inputs: Inputs, rungs: np.ndarray) -> ExactAnswers:
        """Return the outward normal of the exact face; only rays that hit, without ties, are counted."""
        whole = Distance().truth(ladder, inputs, rungs)
        hit = whole.facts["hit"]
        point = inputs["o"] + hit.t.high[:, None] * inputs["d"]
        axis = np.argmax(hit.normal, axis=1)
        with np.errstate(invalid="ignore"):
            outward = hit.normal * np.sign(np.take_along_axis(point, axis[:, None], axis=1))
        tied = np.sum(abs(abs(point) - 0.5) < 2.0**-52, axis=1) > 1
        return ExactAnswers(counted=hit.hit & ~tied, facts={"face": outward}, witness=whole.witness)

    def answer(self, ladder: Ladder, formula: Formula, inputs: Inputs, precision: str) -> Answer:
        """Return the normal in object space."""
        types = array_types(precision)
        columns = uploaded(inputs, types)
        ray = ray_of(columns)
        slabs = FORMULAS[f"cube/{FORMULAS.slots['cube']}"].function
        t = slabs(ray, record("cube", columns, types), ahead(types))
        takes_ray = formula.facts.get("takes") == "ray"
        normal = formula.function(ray, t) if takes_ray else formula.function(ray.at(t))
        return downloaded({"normal": normal}, len(inputs["o"]))

    def grade(self, ladder: Ladder, inputs: Inputs, truth: ExactAnswers, answer: Answer, precision: str) -> Grades:
        """Return wrong faces as false hits."""
        rays = len(inputs["o"])
        unknown = np.full(rays, np.nan)
        wrong = np.any(answer["normal"] != truth.facts["face"], axis=1) & truth.counted
        return Grades(
            counted=truth.counted,
            false_hit=wrong,
            false_miss=nothing(rays),
            invalid=np.any(np.isnan(answer["normal"]), axis=1) & truth.counted,
            error=unknown,
            index=unknown,
        )
