"""Records of `rayproof stability`: a survey, its formulas on ladders, and their results at each value."""

from msgspec import UNSET, Struct, UnsetType, field

from rayproof.reports.results.provenance import Origin


class Rung(Struct, frozen=True, kw_only=True):
    """The results at one value of a ladder's parameter: counts of wrong answers, and errors in the ladder's unit."""

    value: float
    rays: int  # counted rays
    false_hits: int
    false_misses: int
    invalid: int
    median: float | None = None
    median_low: float | None = None  # of its 95 % interval
    median_high: float | None = None
    p99: float | None = None
    worst: float | None = None
    scaled_error: float | None = field(
        default=None, name="worst_over_Ku"
    )  # largest error over condition number and unit roundoff
    double_hits: int | UnsetType = UNSET  # rays through a shared edge that hit both triangles
    acne: int | UnsetType = UNSET  # shadow rays that hit the surface at their origin
    leak: int | UnsetType = UNSET  # shadow rays that missed a blocker between point and light

    @property
    def misclassified(self) -> float:
        """Return the share of rays with a wrong or invalid answer."""
        return (self.false_hits + self.false_misses + self.invalid) / self.rays if self.rays else 0.0

    @property
    def counts(self) -> dict[str, int]:
        """Return the additional counts of the ladder's question, by name."""
        return {name: count for name in COUNTED if (count := getattr(self, name)) is not UNSET}


COUNTED = ("acne", "double_hits", "leak")


class ClimbRecord(Struct, frozen=True, kw_only=True):
    """One formula on one ladder in one precision, and its verdict."""

    ladder: str
    formula: str
    precision: str
    slope: float | None  # of log error over log parameter
    slope_interval: tuple[float, float] | None
    slope_predicted: float | None
    breakpoint: float | None  # of the parameter
    scaled_error: float | None = field(name="worst_error_over_Ku")
    false_hits: int
    false_misses: int
    invalid: int
    rays: int
    per_million: dict[str, float]  # name of an additional count -> count per million rays
    expected: str  # "pass" or "fail"; "none" for a user's own formula
    verdict: str  # pass or fail
    reasons: tuple[str, ...]  # why it failed
    known: str  # why the catalogue expects a failure; empty if it expects none
    surprise: str  # the difference from the expectation of the catalogue; empty if there is none
    values: tuple[Rung, ...]


class SurveyRecord(Struct, frozen=True, kw_only=True):
    """The records of all formulas and ladders, as `rayproof stability --json` writes them."""

    schema: int
    ladders: list[ClimbRecord]
    surprises: int
    doubts: list[str]  # reasons to doubt the truth or the arithmetic itself
    quick: bool
    origin: Origin
    environment: dict[str, str]
    subnormals: dict[str, str]  # precision -> whether they are kept
