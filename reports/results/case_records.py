"""Records of a case and its checks, one class per level; the largest error over its limit; a sign test of factors.

docs/results.md explains each key. The sign test bounds how far chance moves factors that many pixels or cases share.
"""

import math
from collections.abc import Iterable
from operator import add
from typing import TYPE_CHECKING, Annotated, Any, Literal, Required, TypedDict

from msgspec import UNSET, Meta, Struct, UnsetType, field
from msgspec.structs import asdict, astuple, replace

from rayproof.cases.stages import Stage
from rayproof.reports.results.files import at_worst, number
from rayproof.reports.results.outcomes import MEASURED, Outcome

MOST_SECONDS = 1e12  # s, the longest duration of a run; as milliseconds it still fits 64 bits
DIGITS = 5  # significant digits of measured numbers in records; an error is accurate to two or three digits
Number = float | Literal["inf", "-inf", "nan"]  # JSON has no other numbers
if TYPE_CHECKING:
    Real = float  # `compact.expand` converts the strings to float
else:
    Real = Number
Count = Annotated[int, Meta(ge=0)]
Name = Annotated[str, Meta(min_length=1)]
Seconds = Annotated[float, Meta(ge=-MOST_SECONDS, le=MOST_SECONDS)]
Verdict = Annotated[str, Meta(pattern=f"^({'|'.join(Outcome)})$")]

# "with" is a keyword of Python, so that this type needs the functional syntax.
EvidenceRecord = TypedDict("EvidenceRecord", {"with": dict[str, str], "against": dict[str, str]}, total=False)


class Examined(Struct, frozen=True, omit_defaults=True):
    """The numbers of pixels of each kind in a check; `judge.measurement.Kind` defines the kinds."""

    wide: Count = 0
    rounding: Count = 0
    epsilon: Count = 0
    wrong: Count = 0
    unexamined: Count = 0
    pixels: Count = 0  # the number of all pixels; omitted from results.json if it is that of the image

    @property
    def strict(self) -> int:
        """Return the number of pixels of the kind `STRICT`: those that none of the other fields counts."""
        return 2 * self.pixels - sum(astuple(self))

    @property
    def counts(self) -> dict[str, int]:
        """Return the pixel counts by name, with `strict`."""
        return {"pixels": self.pixels, "strict": self.strict, **asdict(self)}

    def __add__(self, other: "Examined") -> "Examined":
        """Return the sums of the pixel counts of two checks."""
        return Examined(*map(add, astuple(self), astuple(other)))


class Measurement(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """The comparison of two renderers' images of one stage.

    A field that is missing in results.json has its default, or the value that `compact.expand` restores.
    """

    worst_ratio: Real = 0.0  # error / limit, inf if the limit is 0 and the error is not
    worst_error: Real | None = 0.0
    limit: Real | None = 0.0  # at the worst pixel
    pixel: tuple[int, int] | None = (0, 0)  # column, row
    ours: tuple[Real, ...] = ()
    theirs: tuple[Real, ...] = ()
    interior: int = field(default_factory=int)  # pixels within their limits that hit a shape (for `ray`: all pixels)
    wrong: int = 0  # pixels over their limits that no nearby problem explains
    explained: int = 0  # pixels over their limits that a nearby problem explains
    hit_miss: int = 0  # wrong pixels where one renderer hits and the other misses or hits another object
    nan: int = 0
    inf: int = 0
    ulp: Real = 0.0  # the worst pixel's error in units in the last place of the reference, in the subject's precision
    mean_wrong: Real = 0.0  # the mean of the finite errors of the wrong pixels
    metrics: dict[str, Real | None] = field(default_factory=dict)  # by name; for information, they decide nothing
    range: tuple[Real, Real] | UnsetType = UNSET  # the range of values to which the metrics are relative
    kinds: Any = None  # only during judging: uint8 (height, width), each pixel's `judge.measurement.Kind`

    def recorded(self, *, values: bool) -> "Measurement":
        """Return the measurement rounded to the digits of a record, without `kinds`.

        The two renderers' values are only included if `values`, for failures; the images contain all values.
        """
        names = ("worst_ratio", "worst_error", "limit", "mean_wrong", *(("ours", "theirs") * values))
        short: dict[str, Any] = {"ours": (), "theirs": ()} | {name: shortened(getattr(self, name)) for name in names}
        return replace(self, **short, ulp=shortened(self.ulp, 3), kinds=None)


class FactorGroup(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """The factors of the pixels of one shape under the same lights, a number per channel, None if it is not lit."""

    shape: int
    lights: tuple[int, ...]  # the lights that the group's pixels see
    pixels: int
    off: list[Real | None]  # subject / reference - 1
    sees: list[Real | None]  # the limit: the largest deviation of a correct renderer, so the smallest detectable one
    fitted: int | None = (
        None  # the light whose factor was fitted, out of several that overlap; None: all lights together
    )
    wide: bool = False  # whether the group has only pixels with wide limits


class Leaning(Struct, frozen=True, kw_only=True):
    """Numbers of distinct values, in pixels with wide limits, above and below the factor that these pixels share."""

    pixels: Count
    above: Count
    below: Count


class Bias(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """The factors that many pixels share at a stage of light."""

    ratio: Real  # the worst factor's distance from 1 over its limit
    sees: Real
    common: Real | None  # the median of the groups' factors, less 1: this case's value of the run's common factor
    allowance: Real  # the limit of a factor that a whole run may share: roundings of constants, step of the output
    groups: list[FactorGroup] | None = None
    wide: Leaning | None = None
    continued: "Bias | None" = None  # relative to the subject's own previous stages; only groups over a limit


class Check(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """The result of one stage of one renderer under test, compared with one reference.

    results.json omits the fields of the check's group, and the values that `compact.expand` restores.
    """

    configuration: str = ""
    reference: str = ""
    stage: Stage = Stage.CAMERA
    outcome: Outcome = field(default=Outcome.PASS, name="verdict")
    reason: str = ""
    ratio: Real = field(default_factory=float)  # a factory, so that `omit_defaults` does not omit 0
    end_to_end: Measurement | None = None
    continued: Measurement | None = None
    examined: Examined | None = None  # pixel counts, or counts of camera entries; None before the pixels are counted
    because: str | int = field(default_factory=str)  # the derivation of the limit
    cells: tuple[str, str] | None = None  # the cells with wrong pixels, in the format of `cells_of`
    evidence: EvidenceRecord | None = None  # of a failure: the references that agree with either renderer, and where
    stopped: bool = False  # not measured because a renderer exceeded its time
    finding: str | None = None  # the checked-in finding that explains it
    bias: Bias | None = None  # at stages of light, compared with the oracle
    # Only during judging:
    suspected: str | None = None  # the suspected reference, if it is not the check's own reference
    abstains: bool = False  # undecided only because the reference declares that it cannot see there, or did not reply

    @property
    def name(self) -> str:
        """Return configuration, reference and stage, which identify the check in its case."""
        return f"{self.configuration} {self.reference} {self.stage}"

    @property
    def alone(self) -> bool:
        """Return whether the stage itself is wrong, given its inputs; the camera has no inputs from other stages."""
        own = self.continued, self.bias and self.bias.continued
        ratios = [part.worst_ratio if isinstance(part, Measurement) else part.ratio for part in own if part is not None]
        return self.outcome is Outcome.FAIL and (self.stage is Stage.CAMERA or any(ratio > 1 for ratio in ratios))

    def recorded(self) -> "Check":
        """Return the check for a run's records: rounded to a few digits, without the fields used only in judging."""
        failed = self.outcome is not Outcome.PASS
        parts = (None if part is None else part.recorded(values=failed) for part in (self.end_to_end, self.continued))
        short = dict(zip(("end_to_end", "continued"), parts, strict=True))
        return replace(self, **short, ratio=shortened(self.ratio), suspected=None, abstains=False)


JUDGING = {"Check": ("suspected", "abstains"), "Measurement": ("kinds",)}  # fields that no file contains


def shortened(value: Any, digits: int = DIGITS) -> Any:
    """Return a float, or a tuple of floats, rounded to the digits of a record; other values unchanged."""
    if isinstance(value, tuple):
        return tuple(shortened(number, digits) for number in value)
    return float(f"{value:.{digits}g}") if isinstance(value, float) else value


class RenderRecord(TypedDict, total=False):
    """One renderer's images of a case."""

    renderer: str
    configuration: str | None
    image: str | None
    error: str | None
    cached: bool
    seconds: Seconds
    kernels: Seconds  # of the tracer: kernel time of one launch, the median of `launches`
    launches: int


class UnsupportedRecord(TypedDict, total=False):
    """A stage that a renderer could not render."""

    reference: str | None
    stage: str | None
    why: str | None


class NoteRecord(TypedDict, total=False):
    """A note that a reference renders a slightly different scene."""

    reference: str | None
    note: str


class ExpectationRecord(TypedDict, total=False):
    """The comparison of one configuration's image with a closed form of the case."""

    because: str
    stage: str
    verdict: str
    measured: Any
    expected: Any
    limit: Any
    ratio: Number
    configuration: str


class ConventionRecord(TypedDict, total=False):
    """A convention that an outlier may follow instead, and the number of its pixels that this explains."""

    what: str
    explains: bool
    ratio: Number | None
    differing: int | None
    interior: int


class AdjudicationRecord(TypedDict, total=False):
    """The comparisons of one stage's images of all renderers with each other."""

    baseline: str
    renderers: list[str]
    ratio: list[list[Number | None]]
    differing: list[list[int | None]]
    alone: str | None
    why: str
    conventions: list[ConventionRecord]


class ComparedCheckRecord(TypedDict):
    """A check in two runs: verdict and worst error over limit before and after, null if the check was not made."""

    configuration: str
    reference: str
    stage: str
    before: list[Any] | None
    after: list[Any] | None
    factor: Number | None  # the ratio after over the ratio before


class ComparedRecord(TypedDict):
    """A case's results in an earlier run, in the report of two runs."""

    before: str
    pixels: int | None
    checks: list[ComparedCheckRecord]


class MasksRecord(TypedDict, total=False):
    """The pixels of one configuration that nearby problems explain: a byte per pixel, deflated, in base64."""

    configuration: str
    height: int
    width: int
    data: str


class RepeatedRecord(TypedDict, total=False):
    """The result of a repeated rendering: whether one configuration's images were the same to the last bit."""

    configuration: str
    stage: str | None
    pixel: list[int] | None
    differing: int
    beyond: Number  # the largest difference over the largest difference of two right renderers
    verdict: Verdict
    sentence: str


class CheckGroupRecord(TypedDict):
    """The checks of one renderer under test against one reference in results.json: one check per stage."""

    configuration: str
    reference: str
    stages: dict[str, Check]  # without `configuration`, `reference` and `stage`


class CaseFacts(TypedDict, total=False):
    """One case: its renderers, and its verdict."""

    name: Required[Name]
    family: Required[Name]
    verdict: Required[Verdict]
    stage: str | None
    item: str | None
    blamed_items: list[str]
    excluded: dict[str, str]
    cause: list[str]
    reason: str | None
    trace: str | None
    stresses: str | None
    covers: list[str]
    compared: ComparedRecord | None
    planned: int
    reproduce: str | None
    scene: str | None
    picture: str | None
    thumbnail: str | None
    preview: str  # replaces images that were left out; empty if it could not be drawn
    pixels: str | None
    masks: MasksRecord | None
    width: int
    height: int
    lights: int
    camera_and_lights: str
    shapes: list[str]
    settings: dict[str, dict[str, str]]
    renders: list[RenderRecord]
    ran: dict[str, list[str]]
    unsupported: list[UnsupportedRecord]
    abstained: dict[str, str]
    stopped: list[str]
    lost: list[str]  # the `serve:` programs that died or exceeded a limit
    growth: Count  # bytes of memory per scene by which a `serve:` program grows
    notes: list[NoteRecord]
    dark: bool  # a user's scene without a lit pixel
    kinds: list[str]  # if a program is under test: the kinds of the case, in words
    refused: bool  # the program declares that it cannot draw the scene
    expectations: list[ExpectationRecord]
    adjudication: dict[str, AdjudicationRecord] | None
    repeated: list[RepeatedRecord]
    versions: dict[str, str]
    remembered: bool
    worker: str
    key: str
    seconds: Seconds
    judge_seconds: Seconds


class CaseRecord(CaseFacts, total=False):
    """A case with its checks."""

    checks: list[Check]


class WrittenCaseRecord(CaseFacts, total=False):
    """A case in the format of results.json: values that its checks share are written once."""

    checks: list[CheckGroupRecord]
    # Reference -> stage -> index of the limit's derivation; a check may have its own instead.
    because: dict[str, dict[str, int]]


# Outcomes of checks that may have measured nothing. Checks of the camera have no measurement although they were made.
UNMEASURED = frozenset(Outcome) - MEASURED

# The sign test of factors that many pixels, or many cases, share.
CHANCE = 2e-9  # probability that a correct renderer fails, per group and channel
LEAST_DISTINCT = 30  # this many signs are all equal with a probability of 2^-29


def worst_ratio(case: CaseRecord) -> float | None:
    """Return the case's largest error over its limit, NaN counted as largest; None if there is none.

    A case's entry in a list (its brief) contains the value already.
    """
    return number(case["worst_ratio"]) if "worst_ratio" in case else worst_of(case.get("checks", []))


def worst_of(checks: Iterable[Check]) -> float | None:
    """Return the largest ratio of error to limit among the checks; NaN counts as the largest, None if there is none."""
    ratios = [at_worst(ratio) for check in checks if (ratio := ratio_of(check)) is not None]
    return max(ratios, default=None)


def ratio_of(check: Check) -> float | None:
    """Return a check's error over its limit: the larger one if it was judged twice.

    None if nothing was measured; results.json contains the ratio 0 for this.
    """
    return check.ratio if check.end_to_end or check.continued or check.outcome not in UNMEASURED else None


def least_share(distinct: int) -> float:
    """Return the smallest share of `distinct` independent values on one side of their median, but for `CHANCE`.

    Half of the signs are expected to be positive; the bound is Hoeffding's inequality (1963, theorem 1).
    """
    return max(0.0, 0.5 - math.sqrt(math.log(2 / CHANCE) / (2 * distinct)))
