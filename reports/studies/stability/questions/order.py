"""Which of two surfaces is the nearer one? Two parallel triangles a small gap apart, asked about one after the other.

Exact t by Cramer's rule, compared without a division; a ray counts if it meets both. The second one taken though it is
the farther one is a false hit, the second one passed over though it is the nearer one a false miss.
Inputs: o, d, the first triangle a, b, c and the second one a2, b2, c2.
"""

import numpy as np

from rayproof.cases.ladders import Inputs, Ladder
from rayproof.reports.studies.stability.device import downloaded, uploaded
from rayproof.reports.studies.stability.exactly import Columns, confirmed, decided, sample
from rayproof.reports.studies.stability.geometry import ahead, ray_of, record
from rayproof.reports.studies.stability.questions import QUESTIONS, Answer, Grades, Truth, Witness
from rayproof.reports.studies.stability.shapes import Triangle
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.formulas import Formula
from rayproof.tracer.kernel.arrays import array_types

TRIANGLE = Triangle()


def second(x: Columns) -> Columns:
    """Return the second triangle with the same ray."""
    return x | {name: x[f"{name}2"] for name in "abc"}


def compared(x: Columns) -> Columns:
    """Return what decides both triangles, and t1 det1 det2 - t2 det1 det2."""
    one, other = TRIANGLE.predicates(x), TRIANGLE.predicates(second(x))
    later = one["t"] * other["det"] - other["t"] * one["det"]
    return one | {f"{name}2": value for name, value in other.items()} | {"later": later}


@QUESTIONS.register("order")
class Order:
    """The slots `nearest` and `triangle`, each with the default of the other."""

    def truth(self, ladder: Ladder, inputs: Inputs, rungs: np.ndarray) -> Truth:
        """Return which rays meet both, and where the second one comes first."""
        signs = decided(compared, inputs)
        witness = Witness(*confirmed(compared, inputs, signs, sample(rungs)))
        both = TRIANGLE.met(signs) & TRIANGLE.met({name: signs[f"{name}2"] for name in ("det", "u", "v", "w", "t")})
        later = signs["later"].astype(int) * signs["det"] * signs["det2"]
        return Truth(counted=both, facts={"second": later > 0}, witness=witness)

    def answer(self, ladder: Ladder, formula: Formula, inputs: Inputs, precision: str) -> Answer:
        """Return 1 where the second triangle is taken."""
        types = array_types(precision)
        configuration = Configuration(precision=precision, formulas={formula.slot: formula.variant})
        x = uploaded(inputs, types)
        best, t = (
            configuration["triangle"](ray_of(x), record("triangle", columns, types), ahead(types))
            for columns in (x, second(x))
        )
        return downloaded({"second": types.Float(configuration["nearest"](t, best))}, len(inputs["o"]))

    def grade(self, ladder: Ladder, inputs: Inputs, truth: Truth, answer: Answer, precision: str) -> Grades:
        """Return wrong orders."""
        said, right = answer["second"] > 0, truth.facts["second"]
        unknown = np.full(len(said), np.nan)
        return Grades(
            counted=truth.counted,
            false_hit=said & ~right & truth.counted,
            false_miss=~said & right & truth.counted,
            invalid=np.zeros(len(said), dtype=bool),
            error=unknown,
            index=unknown,
        )
