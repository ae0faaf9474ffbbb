"""A failure continued from the oracle is put before witnesses, whose answers contradict one of the two.

Continued from a candidate's own stages only the oracle answers. Where those stages agree with the oracle's within every
limit, though, what it continues from them is its answer to the question that all were asked, to within the limits
end to end. So a witness's answer to that question may contradict it, in the very pixels where the candidate fails.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from rayproof.cases.stages import Stage, upto
from rayproof.reports.judge.comparison.check import Check
from rayproof.reports.judge.comparison.measurement import ratios
from rayproof.reports.judge.comparison.pair import Bench
from rayproof.reports.judge.oracle import ORACLE
from rayproof.reports.judge.renderers import Candidate, Witness
from rayproof.reports.judge.tolerance.scene_context import Ground
from rayproof.reports.results.outcomes import Outcome

Side = Literal["with", "against"]


@dataclass(frozen=True, kw_only=True)
class Contradictions:
    """Who may be asked about what the oracle continued."""

    ground: Ground
    candidates: Mapping[str, Candidate]
    witnesses: Mapping[str, Witness]
    checks: Sequence[Check]

    def sides(self, check: Check) -> dict[str, Side]:
        """Return which witnesses side with the one under test, and which against it, in a failure continued alone.

        Nobody is asked where the failure is one end to end as well, where it lies at edges, or where an earlier stage
        has failed: what the oracle continued then answers another question.
        """
        if not self._continued_alone(check):
            return {}
        candidate, stage = self.candidates[check.configuration], check.stage
        assert candidate.answers is not None
        bench = Bench(ground=self.ground, candidate=candidate, witness=self.witnesses[ORACLE])
        value = bench.continued_value(stage)
        limit, edge = bench.terms.continued(stage, value)
        ours = candidate.answers[stage]
        failing = (ratios(stage, ours, value, limit)[0] > 1) & ~edge & ~bench.terms.near
        failing &= ~bench.terms.classes.edge(stage)
        if not failing.any():
            return {}
        found: dict[str, Side] = {}
        for name, witness in self.witnesses.items():
            if name == ORACLE or not witness.independent or stage not in witness.answers:
                continue
            # What was continued from the candidate's stages is off by as much as these are.
            against_it = _differs(self.ground, candidate, witness, stage, value)[failing]
            from_us = _differs(self.ground, candidate, witness, stage, ours)[failing]
            if against_it.all() and not from_us.any():
                found[name] = "with"
            elif from_us.any() and not against_it.any():
                found[name] = "against"
        return found

    def _continued_alone(self, check: Check) -> bool:
        if check.reference != ORACLE or check.outcome is not Outcome.FAIL or check.stage is Stage.CAMERA:
            return False
        whole, alone = check.end_to_end, check.continued
        if whole is None or alone is None or not whole.worst_ratio <= 1 or alone.worst_ratio <= 1:
            return False
        earlier = set(upto(check.stage)[:-1])
        return not any(
            other.outcome is Outcome.FAIL
            for other in self.checks
            if (other.configuration, other.reference) == (check.configuration, ORACLE) and other.stage in earlier
        )


def _differs(ground: Ground, party: Candidate, witness: Witness, stage: Stage, value: np.ndarray) -> np.ndarray:
    """Return where a party's value at a stage is over the limit of the two from the witness's, (height, width)."""
    limits = Bench(ground=ground, candidate=party, witness=witness).terms.limits.end_to_end
    limit = limits.get(stage, np.zeros(ground.conditioning.hit.shape))
    theirs = np.asarray(witness.answers[stage], dtype=np.float64)
    return ~(ratios(stage, np.asarray(value, dtype=np.float64), theirs, limit)[0] <= 1)
