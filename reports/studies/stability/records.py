"""Records of `rayproof stability`: a survey, its climbs and their rungs, as they are computed, written and read."""

from msgspec import UNSET, Struct, UnsetType, field

from rayproof.reports.results.provenance import Origin


class Rung(Struct, frozen=True, kw_only=True):
    """One value of a ladder's parameter: how many rays were answered wrongly, and the errors in the ladder's unit."""

    value: float
    rays: int  # counted ones
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
    double_hits: int | UnsetType = UNSET  # rays through a shared edge that met both triangles
    acne: int | UnsetType = UNSET  # shadow rays that met the surface that they leave
    leak: int | UnsetType = UNSET  # shadow rays that missed what is between point and light

    @property
    def misclassified(self) -> float:
        """Return the share of rays that were answered wrongly or not at all."""
        return (self.false_hits + self.false_misses + self.invalid) / self.rays if self.rays else 0.0

    @property
    def counts(self) -> dict[str, int]:
        """Return what the ladder's question counts beside hits and misses, by name."""
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
    per_million: dict[str, float]  # what is counted beside hits -> per million rays
    expected: str  # pass or fail; of a user's own formula, none
    verdict: str  # pass or fail
    reasons: tuple[str, ...]  # why it failed
    known: str  # why the catalogue expects a failure, or nothing
    surprise: str  # why this is not what the catalogue says; empty if it is
    values: tuple[Rung, ...]


class SurveyRecord(Struct, frozen=True, kw_only=True):
    """What `rayproof stability --json` writes."""

    schema: int
    ladders: list[ClimbRecord]
    surprises: int
    doubts: list[str]  # what makes the truth or the arithmetic itself unsure
    quick: bool
    origin: Origin
    environment: dict[str, str]
    subnormals: dict[str, str]  # precision -> whether they are kept
