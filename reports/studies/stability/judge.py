"""What the catalogue says of a formula on a ladder, against what was measured. Anything else is a surprise."""

from dataclasses import dataclass

from rayproof.cases.ladders import Ladder, PredictedSlope
from rayproof.reports.studies.stability.climb import Climb, Drawn
from rayproof.tracer.formulas.own_file import is_own

WITNESS_LIMIT = 2.0**-60  # relative; the truth must be far better than the best answer


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """The outcome of one climb."""

    climb: Climb
    law: PredictedSlope | None
    expected: str  # pass or fail; of a user's own formula, none
    verdict: str  # pass or fail
    reasons: tuple[str, ...]  # why it failed
    surprise: str  # why this is not what the catalogue says; empty if it is


def judged(climb: Climb) -> Verdict:
    """Return the verdict: the gate, then the slope, then whether the catalogue said so."""
    ladder, name = climb.ladder, climb.formula.name
    if is_own(climb.formula.variant):
        gate = _gate(climb)
        return Verdict(
            climb=climb,
            law=None,
            expected="none",
            verdict="fail" if gate else "pass",
            reasons=(gate,) if gate else (),
            surprise="",
        )
    failure = ladder.failure(name, climb.precision)
    law = ladder.predicted(name, climb.precision)
    gate, slope = _gate(climb), _slope(climb, law)
    expected = "fail" if failure else "pass"
    surprise = slope
    if failure and not gate:
        surprise = f"passes, but the catalogue expects it to fail: {failure.because}"
    elif not failure and gate:
        surprise = gate
    return Verdict(
        climb=climb,
        law=law,
        expected=expected,
        verdict="fail" if gate or slope else "pass",
        reasons=tuple(reason for reason in (gate, slope) if reason),
        surprise=surprise,
    )


def _gate(climb: Climb) -> str:
    """Return in words how the gate was missed, or nothing."""
    ladder = climb.ladder
    needed = ladder.gate.reaches[climb.precision]
    values = list(ladder.values)
    reached = climb.breakpoint
    if reached is not None and values.index(reached) >= values.index(needed):
        return ""
    rung = next(rung for rung in climb.rungs if not climb.holds(rung))
    told = [
        f"{rung.misclassified:.3%} of {rung.rays} rays answered wrongly ({rung.false_hits} false hits, "
        f"{rung.false_misses} false misses, {rung.invalid} invalid)"
        if rung.misclassified > ladder.gate.misclassified
        else "",
        f"error {rung.index:.3g} K u" if rung.index is not None and rung.index > ladder.gate.index else "",
        "nothing to count" if not rung.rays else "",
    ]
    return f"breaks at {rung.value:g}, before {needed:g}: {', '.join(part for part in told if part)}"


def _slope(climb: Climb, law: PredictedSlope | None) -> str:
    """Return in words how the slope differs from the predicted one, or nothing."""
    if law is None:
        return ""
    if climb.slope.value is None:
        # No error at all is as flat as can be.
        exact = all(not rung.median for rung in climb.rungs)
        return "" if exact and law.slope == 0 else f"no slope to fit, {law.slope:g} predicted: {law.because}"
    if abs(climb.slope.value - law.slope) <= law.within:
        return ""
    return f"slope {climb.slope.value:.2f}, {law.slope:g} +- {law.within:g} predicted: {law.because}"


def doubted(given: Drawn) -> str:
    """Return in words why the truth about some inputs is in doubt, or nothing."""
    witness = given.truth.witness
    ladder: Ladder = given.ladder
    limit = 0.0 if ladder.question == "watertight" else WITNESS_LIMIT
    if witness.worst <= limit:
        return ""
    return f"{ladder.name} in {given.precision}: the truth is {witness.worst:.2g} from its witness"
