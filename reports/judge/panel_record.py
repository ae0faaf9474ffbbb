"""What a case's record says of the panel: each stage's matrix, who stands alone, and which convention explains it."""

from collections.abc import Sequence

from rayproof.cases.stages import Stage
from rayproof.reports.judge.comparison.image_shapes import well_shaped
from rayproof.reports.judge.oracle import ORACLE, FullOracle
from rayproof.reports.judge.panel.code_families import voice
from rayproof.reports.judge.panel.conventions import Tested, in_words, tested
from rayproof.reports.judge.panel.outlier import Standing, standing
from rayproof.reports.judge.renderers import Candidate, Witness, as_candidate
from rayproof.reports.judge.verdict.case_verdict import Judged
from rayproof.reports.results.records import AdjudicationRecord


def adjudication(
    judged: Judged, candidates: Sequence[Candidate], witnesses: Sequence[Witness], oracle: FullOracle
) -> dict[str, AdjudicationRecord]:
    """Return {stage: matrix, baseline of interior and limits, who stands alone, why} as docs/results.md describes it.

    Conventions are put to the test for each voice that stands alone, at the first image stage at which it does: what
    follows from there follows from that.
    """
    names = {candidate.name for candidate in candidates}
    parties = {candidate.name: candidate for candidate in candidates}
    parties |= {witness.name: as_candidate(witness) for witness in witnesses}
    parties = {name: well_shaped(judged.case.scene, party) for name, party in parties.items()}
    record: dict[str, AdjudicationRecord] = {}
    first: dict[str, Stage] = {}
    for stage, matrix in judged.panel.items():
        one = standing(matrix, lambda name: voice(name, names))
        results: list[Tested] = []
        words = ""
        who = _whose(one)
        if who in first:
            words = f" It is off from {first[who]} on."
        elif who is not None and stage is not Stage.CAMERA:
            first[who] = stage
            results = tested(judged.case.scene, parties[who], stage, oracle)
            words = in_words(results)
        record[stage.value] = {
            "baseline": ORACLE,
            **matrix.as_json(),
            "alone": ", ".join(one.alone) or None,
            "why": one.why + words,
        }
        if results:
            record[stage.value]["conventions"] = [result.as_json() for result in results]
    return record


def _whose(one: Standing) -> str | None:
    """Return whose answers to hold against conventions: who stands alone, or whom the oracle stands against."""
    if not one.alone:
        return None
    return one.alone[0] if one.alone[0] != ORACLE else one.majority[0]
