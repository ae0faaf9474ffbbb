"""Verdicts as plain data: what `--json` writes and what tables and figures are made from."""

from collections.abc import Sequence
from typing import NotRequired, TypedDict, cast

from rayproof.cases.ladders.ladder import Ladder
from rayproof.reports.studies.stability.climb import Climb, Rung
from rayproof.reports.studies.stability.judge import Verdict
from rayproof.tracer.formula import is_own


class RungRecord(TypedDict):
    """One value of a ladder's parameter: how many rays were answered wrongly, and the errors in the ladder's unit."""

    value: float
    rays: int
    false_hits: int
    false_misses: int
    invalid: int
    median: float | None
    median_low: float | None  # of its 95 % interval
    median_high: float | None
    p99: float | None
    worst: float | None
    worst_over_Ku: float | None  # largest error over condition number and unit roundoff
    double_hits: NotRequired[int]  # rays through a shared edge that met both triangles
    acne: NotRequired[int]  # feelers that met the surface that they leave
    leak: NotRequired[int]  # feelers that missed what is between point and light


class ClimbRecord(TypedDict):
    """One formula on one ladder in one precision."""

    ladder: str
    formula: str
    precision: str
    slope: float | None  # of log error over log parameter
    slope_interval: list[float] | None
    slope_predicted: float | None
    breakpoint: float | None  # of the parameter
    worst_error_over_Ku: float | None
    false_hits: int
    false_misses: int
    invalid: int
    rays: int
    per_million: dict[str, float]  # what is counted beside hits -> per million rays
    expected: str
    verdict: str
    reasons: list[str]
    known: str  # why the catalogue expects a failure, or nothing
    surprise: str
    values: list[RungRecord]


class GateRecord(TypedDict):
    """What a formula has to reach on a ladder."""

    reaches: dict[str, float]  # precision -> value of the parameter
    misclassified: float  # share of rays
    error_over_Ku: float | None


class LawRecord(TypedDict):
    """The slope that mathematics predicts for some formulas, from the value `first` on."""

    formulas: list[str]
    precisions: list[str]
    slope: float | None
    because: str
    first: float


class LadderRecord(TypedDict):
    """What the catalogue says of a ladder; `climbs` is there where its climbs are written with it."""

    ladder: str
    group: str
    kind: str
    saturated: float  # median error from which on a value says nothing about the slope
    slots: list[str]
    parameter: str
    values: list[float]
    unit: str
    condition: str
    gate: GateRecord
    first_to_break: str
    survivor: str
    measured: str
    laws: list[LawRecord]
    climbs: NotRequired[list[ClimbRecord]]


class SurveyAbout(TypedDict):
    """What is true of all climbs of a survey."""

    schema: int
    surprises: int
    doubts: list[str]  # what makes the truth or the arithmetic itself unsure
    quick: bool
    environment: dict[str, str]
    subnormals: dict[str, str]  # precision -> whether they are kept


class SurveyRecord(SurveyAbout):
    """What `rayproof stability --json` writes."""

    ladders: list[ClimbRecord]


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


def about(ladder: Ladder) -> LadderRecord:
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
            for law in ladder.laws
        ],
    }


def worst_first(records: Sequence[ClimbRecord]) -> list[ClimbRecord]:
    """Return surprises first, then failures, then the largest share of wrong answers and the largest error."""

    def badness(climb: ClimbRecord) -> tuple[bool, bool, float, float, str, str]:
        wrong = (climb["false_hits"] + climb["false_misses"] + climb["invalid"]) / max(1, climb["rays"])
        error = climb["worst_error_over_Ku"] or 0.0
        return (not climb["surprise"], climb["verdict"] == "pass", -wrong, -error, climb["ladder"], climb["formula"])

    return sorted(records, key=badness)
