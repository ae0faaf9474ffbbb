"""Which face of the cube did the ray hit? The whole way: slabs, point, normal. A wrong face counts as a false hit.

Truth: the face that the exact ray enters last or leaves first; ties, where it meets an edge itself, are not counted.
"""

import numpy as np

from rayproof.cases.ladders import Inputs, Ladder
from rayproof.reports.studies.stability.device import downloaded, uploaded
from rayproof.reports.studies.stability.geometry import ahead, ray_of, record
from rayproof.reports.studies.stability.questions import QUESTIONS, Answer, Grades, Truth, nothing
from rayproof.reports.studies.stability.questions.distance import Distance
from rayproof.tracer.formulas import FORMULAS, Formula
from rayproof.tracer.kernel.arrays import array_types


@QUESTIONS.register("face")
class Face:
    """The outward axis at the nearest hit, by the default slabs."""

    def truth(self, ladder: Ladder, inputs: Inputs, rungs: np.ndarray) -> Truth:
        """Return the exact face; a ray that misses has none."""
        whole = Distance().truth(ladder, inputs, rungs)
        hit = whole.facts["hit"]
        point = inputs["o"] + hit.t.high[:, None] * inputs["d"]
        axis = np.argmax(hit.normal, axis=1)
        with np.errstate(invalid="ignore"):
            outward = hit.normal * np.sign(np.take_along_axis(point, axis[:, None], axis=1))
        tied = np.sum(abs(abs(point) - 0.5) < 2.0**-52, axis=1) > 1
        return Truth(counted=hit.hit & ~tied, facts={"face": outward}, witness=whole.witness)

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

    def grade(self, ladder: Ladder, inputs: Inputs, truth: Truth, answer: Answer, precision: str) -> Grades:
        """Return wrong faces."""
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
