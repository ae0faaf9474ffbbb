"""The survey: the plan of formulas and ladders, the verdicts by gate and slope, and their records."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import Any

from rayproof.cases.ladders import Ladder, PredictedSlope, all_ladders
from rayproof.reports.studies.stability.climb import Climb, Drawn, climb, drawn
from rayproof.reports.studies.stability.device import broken
from rayproof.reports.studies.stability.records import ClimbRecord
from rayproof.tracer.formulas import FORMULAS, Formula
from rayproof.tracer.formulas.own_file import is_own

# The measured verdict of a formula on a ladder, compared with the catalogue's expectation. A difference is a surprise.


WITNESS_LIMIT = 2.0**-60  # relative; the truth must be far better than the best answer


def judged(climb: Climb) -> ClimbRecord:
    """Return the record of a formula on a ladder: its verdict by gate and slope, and any surprise."""
    ladder, name, slope = climb.ladder, climb.formula.name, climb.slope
    gate = _gate(climb)
    if is_own(climb.formula.variant):
        failure = law = None
        expected, wrong_slope, surprise = "none", "", ""
    else:
        failure = ladder.failure(name, climb.precision)
        law = ladder.predicted(name, climb.precision)
        expected, wrong_slope = "fail" if failure else "pass", _slope(climb, law)
        surprise = wrong_slope
        if failure and not gate:
            surprise = f"passes, but the catalogue expects it to fail: {failure.because}"
        elif not failure and gate:
            surprise = gate
    return ClimbRecord(
        ladder=ladder.name,
        formula=name,
        precision=climb.precision,
        slope=slope.value,
        slope_interval=slope.interval,
        slope_predicted=law.slope if law else None,
        breakpoint=climb.breakpoint,
        scaled_error=climb.worst_index,
        false_hits=climb.total("false_hits"),
        false_misses=climb.total("false_misses"),
        invalid=climb.total("invalid"),
        rays=climb.total("rays"),
        per_million=per_million(climb),
        expected=expected,
        verdict="fail" if gate or wrong_slope else "pass",
        reasons=tuple(reason for reason in (gate, wrong_slope) if reason),
        known=failure.because if failure else "",
        surprise=surprise,
        values=climb.rungs,
    )


def _gate(climb: Climb) -> str:
    """Return the message about a missed gate, or an empty string."""
    ladder = climb.ladder
    needed = ladder.gate.reaches[climb.precision]
    values = list(ladder.values)
    reached = climb.breakpoint
    if reached is not None and values.index(reached) >= values.index(needed):
        return ""
    rung = next(rung for rung in climb.rungs if not climb.holds(rung))
    error = rung.scaled_error
    reasons = [
        f"{rung.misclassified:.3%} of {rung.rays} rays answered wrongly ({rung.false_hits} false hits, "
        f"{rung.false_misses} false misses, {rung.invalid} invalid)"
        if rung.misclassified > ladder.gate.misclassified
        else "",
        f"error {error:.3g} K u" if error is not None and error > ladder.gate.index else "",
        "nothing to count" if not rung.rays else "",
    ]
    return f"breaks at {rung.value:g}, before {needed:g}: {', '.join(part for part in reasons if part)}"


def _slope(climb: Climb, law: PredictedSlope | None) -> str:
    """Return the message about a slope that differs from the predicted slope, or an empty string."""
    if law is None:
        return ""
    if climb.slope.value is None:
        # Without any error the slope counts as 0.
        exact = all(not rung.median for rung in climb.rungs)
        return "" if exact and law.slope == 0 else f"no slope to fit, {law.slope:g} predicted: {law.because}"
    if abs(climb.slope.value - law.slope) <= law.within:
        return ""
    return f"slope {climb.slope.value:.2f}, {law.slope:g} +- {law.within:g} predicted: {law.because}"


def doubted(batch: Drawn) -> str:
    """Return the message about inputs whose truth the second arithmetic does not confirm, or an empty string."""
    witness = batch.truth.witness
    ladder: Ladder = batch.ladder
    limit = 0.0 if ladder.question == "watertight" else WITNESS_LIMIT
    if witness.worst <= limit:
        return ""
    return f"{ladder.name} in {batch.precision}: the truth is {witness.worst:.2g} from its witness"


def per_million(climb: Climb) -> dict[str, float]:
    """Return the additional counts per million rays, by name; leaks are false misses on a closed surface."""
    rays = climb.total("rays")
    if not rays:
        return {}
    names = {name for rung in climb.rungs for name in rung.counts}
    counts = {name: sum(rung.counts.get(name, 0) for rung in climb.rungs) for name in sorted(names)}
    if climb.ladder.question == "watertight":
        counts = {"leaks": climb.total("false_misses")} | counts
    return {name: 1e6 * count / rays for name, count in counts.items()}


def about(ladder: Ladder) -> dict[str, Any]:
    """Return the catalogue's entry of a ladder; a law predicts a slope from the value `first` on."""
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
    """Return the records sorted: surprises, then failures, then by the share of wrong answers and the error."""

    def badness(climb: ClimbRecord) -> tuple[bool, bool, float, float, str, str]:
        wrong = (climb.false_hits + climb.false_misses + climb.invalid) / max(1, climb.rays)
        error = climb.scaled_error or 0.0
        return (not climb.surprise, climb.verdict == "pass", -wrong, -error, climb.ladder, climb.formula)

    return sorted(records, key=badness)


# Every chosen formula on every ladder of its slot, in every requested precision.


@dataclass(frozen=True, kw_only=True)
class SurveyPlan:
    """The ladders with their formulas, and the precisions."""

    ladders: tuple[tuple[Ladder, tuple[Formula, ...]], ...]
    precisions: tuple[str, ...]
    quick: bool

    @property
    def climbs(self) -> int:
        """Return the number of combinations of ladder, formula and precision."""
        return sum(len(formulas) for _, formulas in self.ladders) * len(self.precisions)


def applies(ladder: Ladder, formula: Formula) -> bool:
    """Return whether a ladder tests a formula: it tests the variants of its slots except planted faults.

    A ladder tests a user's own formula if it tests the default of its slot.
    """
    variant = FORMULAS.slots[formula.slot] if is_own(formula.variant) else formula.variant
    chosen = not ladder.only or variant in ladder.only
    return formula.slot in ladder.slots and formula.kind != "fault" and chosen


def plan(patterns: Sequence[str], *, ladders: Sequence[str], precisions: Sequence[str], quick: bool) -> SurveyPlan:
    """Return the plan of the formulas that `patterns` name on `ladders`.

    A pattern is a slot, slot/variant, a glob, or a function of the user's, slot=FILE.py:function; without patterns all
    formulas are planned.

    Raises:
        LookupError: a pattern names no formula that is on any ladder, or no ladder.

    """
    catalogue = all_ladders()
    climbing = {name for ladder in catalogue for name in FORMULAS if applies(ladder, FORMULAS[name])}
    formulas: set[str] = set()
    own = [FORMULAS.named(pattern) for pattern in patterns if is_own(pattern)]
    for formula in own:
        if not any(applies(ladder, formula) for ladder in catalogue):
            raise LookupError(f"the slot {formula.slot} is on no ladder")
    for pattern in [pattern for pattern in patterns if not is_own(pattern)] or (() if own else ("*",)):
        matching = {name for name in climbing if fnmatchcase(name, pattern) or name.split("/")[0] == pattern}
        if not matching:
            ladder_names = ", ".join(ladder.name for ladder in catalogue)
            raise LookupError(
                f"no ladder is called {pattern!r}, and no formula on one; ladders: {ladder_names}; "
                f"formulas: {', '.join(sorted(climbing))}"
            )
        formulas |= matching
    names: set[str] = set()
    for pattern in ladders or ("*",):
        called = {ladder.name for ladder in catalogue if fnmatchcase(ladder.name, pattern)}
        if not called:
            raise LookupError(
                f"no ladder is called {pattern!r}; known: {', '.join(ladder.name for ladder in catalogue)}"
            )
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
        for ladder in catalogue
        if ladder.name in names
    )
    chosen = tuple((ladder, climbers) for ladder, climbers in pairs if climbers)
    return SurveyPlan(ladders=chosen, precisions=tuple(precisions), quick=quick)


def survey(planned: SurveyPlan, *, doubts: Callable[[str], None]) -> Iterator[ClimbRecord]:
    """Yield the records of a plan; pass reasons to doubt the truth or the arithmetic itself to `doubts`."""
    for precision in planned.precisions:
        for failure in broken(precision):
            doubts(failure)
    for ladder, formulas in planned.ladders:
        for precision in planned.precisions:
            batch = drawn(ladder, precision, quick=planned.quick)
            if doubt := doubted(batch):
                doubts(doubt)
            for formula in formulas:
                yield judged(climb(batch, formula))
