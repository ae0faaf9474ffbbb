"""The survey: which formulas climb which ladders, the verdict of each climb by gate and slope, and its record."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import cast

from rayproof.cases.ladders import Ladder, PredictedSlope, all_ladders
from rayproof.reports.studies.stability.climb import Climb, Drawn, Rung, climb, drawn
from rayproof.reports.studies.stability.device import broken
from rayproof.reports.studies.stability.records import (
    ClimbRecord,
    LadderAbout,
    RungRecord,
)
from rayproof.tracer.formulas import FORMULAS, Formula
from rayproof.tracer.formulas.own_file import is_own

# What the catalogue says of a formula on a ladder, against what was measured. Anything else is a surprise.


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


def doubted(batch: Drawn) -> str:
    """Return in words why the truth about some inputs is in doubt, or nothing."""
    witness = batch.truth.witness
    ladder: Ladder = batch.ladder
    limit = 0.0 if ladder.question == "watertight" else WITNESS_LIMIT
    if witness.worst <= limit:
        return ""
    return f"{ladder.name} in {batch.precision}: the truth is {witness.worst:.2g} from its witness"


# Verdicts as plain data: what `--json` writes and what tables and figures are made from.


def record(verdict: Verdict) -> ClimbRecord:
    """Return one formula on one ladder in one precision."""
    climb = verdict.climb
    slope = climb.slope
    return {
        "ladder": climb.ladder.name,
        "formula": climb.formula.name,
        "precision": climb.precision,
        "slope": slope.value,
        "slope_interval": list(slope.interval) if slope.interval else None,
        "slope_predicted": verdict.law.slope if verdict.law else None,
        "breakpoint": climb.breakpoint,
        "worst_error_over_Ku": climb.worst_index,
        "false_hits": climb.total("false_hits"),
        "false_misses": climb.total("false_misses"),
        "invalid": climb.total("invalid"),
        "rays": climb.total("rays"),
        "per_million": per_million(climb),
        "expected": verdict.expected,
        "verdict": verdict.verdict,
        "reasons": list(verdict.reasons),
        "known": known(climb),
        "surprise": verdict.surprise,
        "values": [rung_record(rung) for rung in climb.rungs],
    }


def known(climb: Climb) -> str:
    """Return why the catalogue expects a failure, or nothing."""
    if is_own(climb.formula.variant):
        return ""
    failure = climb.ladder.failure(climb.formula.name, climb.precision)
    return failure.because if failure else ""


def per_million(climb: Climb) -> dict[str, float]:
    """Return what is counted beside hits, per million rays; leaks are false misses on a closed surface."""
    rays = climb.total("rays")
    if not rays:
        return {}
    names = {name for rung in climb.rungs for name in rung.counts}
    counts = {name: sum(rung.counts.get(name, 0) for rung in climb.rungs) for name in sorted(names)}
    if climb.ladder.question == "watertight":
        counts = {"leaks": climb.total("false_misses")} | counts
    return {name: 1e6 * count / rays for name, count in counts.items()}


def rung_record(rung: Rung) -> RungRecord:
    """Return one value of a sweep."""
    measured = {
        "value": rung.value,
        "rays": rung.rays,
        "false_hits": rung.false_hits,
        "false_misses": rung.false_misses,
        "invalid": rung.invalid,
        "median": rung.median,
        "median_low": rung.median_low,
        "median_high": rung.median_high,
        "p99": rung.p99,
        "worst": rung.worst,
        "worst_over_Ku": rung.index,
    }
    return cast("RungRecord", measured | rung.counts)  # a question names what it counts


def about(ladder: Ladder) -> LadderAbout:
    """Return what the catalogue says of a ladder."""
    return {
        "ladder": ladder.name,
        "group": ladder.group,
        "kind": ladder.kind,
        "saturated": ladder.saturated,
        "slots": list(ladder.slots),
        "parameter": ladder.parameter,
        "values": list(ladder.values),
        "unit": ladder.unit,
        "condition": ladder.condition,
        "gate": {
            "reaches": dict(ladder.gate.reaches),
            "misclassified": ladder.gate.misclassified,
            "error_over_Ku": ladder.gate.index,
        },
        "first_to_break": ladder.first_to_break,
        "survivor": ladder.survivor,
        "measured": ladder.measured,
        "laws": [
            {
                "formulas": list(law.formulas),
                "precisions": list(law.precisions),
                "slope": law.slope,
                "because": law.because,
                "first": ladder.values[law.skip],
            }
            for law in ladder.slopes
        ],
    }


def worst_first(records: Sequence[ClimbRecord]) -> list[ClimbRecord]:
    """Return surprises first, then failures, then the largest share of wrong answers and the largest error."""

    def badness(climb: ClimbRecord) -> tuple[bool, bool, float, float, str, str]:
        wrong = (climb["false_hits"] + climb["false_misses"] + climb["invalid"]) / max(1, climb["rays"])
        error = climb["worst_error_over_Ku"] or 0.0
        return (not climb["surprise"], climb["verdict"] == "pass", -wrong, -error, climb["ladder"], climb["formula"])

    return sorted(records, key=badness)


# Every chosen formula on every ladder that applies, in every precision asked for.


@dataclass(frozen=True, kw_only=True)
class Plan:
    """Which formulas climb which ladders."""

    ladders: tuple[tuple[Ladder, tuple[Formula, ...]], ...]
    precisions: tuple[str, ...]
    quick: bool

    @property
    def climbs(self) -> int:
        """Return how many there are."""
        return sum(len(formulas) for _, formulas in self.ladders) * len(self.precisions)


def applies(ladder: Ladder, formula: Formula) -> bool:
    """Return whether a formula climbs a ladder: every variant of its slots, planted faults aside.

    A user's own formula climbs where the default of its slot does.
    """
    known = FORMULAS.slots[formula.slot] if is_own(formula.variant) else formula.variant
    chosen = not ladder.only or known in ladder.only
    return formula.slot in ladder.slots and formula.kind != "fault" and chosen


def plan(patterns: Sequence[str], *, ladders: Sequence[str], precisions: Sequence[str], quick: bool) -> Plan:
    """Return the climbs of the formulas named by `patterns` on `ladders`.

    A pattern is a slot, slot/variant, a glob, or a function of the user's, slot=FILE.py:function; none: all.

    Raises:
        LookupError: a pattern names no formula that is on any ladder, or no ladder.

    """
    known = all_ladders()
    climbing = {name for ladder in known for name in FORMULAS if applies(ladder, FORMULAS[name])}
    formulas: set[str] = set()
    own = [FORMULAS.named(pattern) for pattern in patterns if is_own(pattern)]
    for formula in own:
        if not any(applies(ladder, formula) for ladder in known):
            raise LookupError(f"the slot {formula.slot} is on no ladder")
    for pattern in [one for one in patterns if not is_own(one)] or (() if own else ("*",)):
        found = {name for name in climbing if fnmatchcase(name, pattern) or name.split("/")[0] == pattern}
        if not found:
            ladder_names = ", ".join(ladder.name for ladder in known)
            raise LookupError(
                f"no ladder is called {pattern!r}, and no formula on one; ladders: {ladder_names}; "
                f"formulas: {', '.join(sorted(climbing))}"
            )
        formulas |= found
    names: set[str] = set()
    for pattern in ladders or ("*",):
        called = {ladder.name for ladder in known if fnmatchcase(ladder.name, pattern)}
        if not called:
            raise LookupError(f"no ladder is called {pattern!r}; known: {', '.join(ladder.name for ladder in known)}")
        names |= called
    pairs = (
        (
            ladder,
            tuple(
                formula
                for slot in ladder.slots
                for formula in (*FORMULAS.variants(slot), *own)
                if (formula.name in formulas or formula in own) and formula.slot == slot and applies(ladder, formula)
            ),
        )
        for ladder in known
        if ladder.name in names
    )
    chosen = tuple((ladder, climbers) for ladder, climbers in pairs if climbers)
    return Plan(ladders=chosen, precisions=tuple(precisions), quick=quick)


def survey(planned: Plan, *, doubts: Callable[[str], None]) -> Iterator[ClimbRecord]:
    """Yield a record per climb; tell `doubts` what makes the truth or the arithmetic itself unsure."""
    for precision in planned.precisions:
        for guard in broken(precision):
            doubts(guard)
    for ladder, formulas in planned.ladders:
        for precision in planned.precisions:
            given = drawn(ladder, precision, quick=planned.quick)
            if doubt := doubted(given):
                doubts(doubt)
            for formula in formulas:
                yield record(judged(climb(given, formula)))
