"""Verdicts as plain data: what `--json` writes and what tables and figures are made from."""

from collections.abc import Sequence
from typing import cast

from rayproof.cases.ladders import Ladder
from rayproof.reports.studies.stability.climb import Climb, Rung
from rayproof.reports.studies.stability.judge import Verdict
from rayproof.reports.studies.stability.records import ClimbRecord, LadderAbout, RungRecord
from rayproof.tracer.formulas.own_file import is_own


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
