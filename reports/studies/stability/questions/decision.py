"""Does a formula decide rightly? For slots that answer yes or no to a question about signs.

One entry of `ASKED` a slot: the numbers whose signs decide, what they decide, and how the formula is asked. Exact
rationals settle what pairs leave in doubt, ties included; balls confirm a sample. A wrong yes is a false hit.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from rayproof.cases.ladders import Inputs, Ladder
from rayproof.reports.studies.stability.device import downloaded, uploaded
from rayproof.reports.studies.stability.exactly import Columns, Mathematics, confirmed, decided, sample
from rayproof.reports.studies.stability.mathematics import dot
from rayproof.reports.studies.stability.questions import QUESTIONS, Answer, Grades, Truth, Witness
from rayproof.reports.studies.stability.shapes import Signs
from rayproof.tracer.formulas import FORMULAS, Formula
from rayproof.tracer.kernel.arrays import array_types
from rayproof.tracer.rays import Interval


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
        said, yes = answer["yes"] > 0, truth.facts["yes"]
        unknown = np.full(len(said), np.nan)
        return Grades(
            counted=truth.counted,
            false_hit=said & ~yes,
            false_miss=~said & yes,
            invalid=np.zeros(len(said), dtype=bool),
            error=unknown,
            index=unknown,
        )
