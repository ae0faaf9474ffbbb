"""Records of `rayproof stability`: surveys, ladders, climbs, rungs, searches for the worst."""

from typing import NotRequired, TypedDict

from rayproof.reports.results.provenance import Origin


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
    acne: NotRequired[int]  # shadow rays that met the surface that they leave
    leak: NotRequired[int]  # shadow rays that missed what is between point and light


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


class LadderAbout(TypedDict):
    """What the catalogue says of a ladder."""

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


class LadderRecord(LadderAbout):
    """A ladder with its climbs."""

    climbs: list[ClimbRecord]


class SurveyAbout(TypedDict):
    """What is true of all climbs of a survey."""

    schema: int
    surprises: int
    doubts: list[str]  # what makes the truth or the arithmetic itself unsure
    quick: bool
    origin: Origin
    environment: dict[str, str]
    subnormals: dict[str, str]  # precision -> whether they are kept


class WorstRecord(TypedDict):
    """What a search for the worst inputs of a formula found."""

    formula: str
    ladder: str  # that asks about such inputs
    tried: int
    beyond: int  # of the worst, those answered beyond their limit
    scores: list[float]  # of the worst, in units of the limit
    common: list[str]  # what they have in common
    worst: list[list[str]]  # the first ones: formula, ladder, what is wrong, limits, inputs


class WorstSearch(TypedDict):
    """What `rayproof worst --json` writes."""

    schema: int
    origin: Origin
    seconds: float  # for each formula
    precision: str
    formulas: list[WorstRecord]


class SurveyRecord(SurveyAbout):
    """What `rayproof stability --json` writes."""

    ladders: list[ClimbRecord]
