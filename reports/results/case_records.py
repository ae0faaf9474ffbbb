"""Records of a case and its checks, one class a level; the largest error over its limit; a sign test of factors.

docs/results.md explains each key. The sign test gives what chance makes of factors that many pixels or cases share.
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

MOST_SECONDS = 1e12  # s that a run may have taken; thousandths of it are still numbers of 64 bits
DIGITS = 5  # of a measured number, in records: an error is known to two or three of them
Number = float | Literal["inf", "-inf", "nan"]  # JSON has no other numbers
if TYPE_CHECKING:
    Real = float  # as which `compact.expand` reads the strings
else:
    Real = Number
Count = Annotated[int, Meta(ge=0)]
Name = Annotated[str, Meta(min_length=1)]
Seconds = Annotated[float, Meta(ge=-MOST_SECONDS, le=MOST_SECONDS)]
Verdict = Annotated[str, Meta(pattern=f"^({'|'.join(Outcome)})$")]

# "with" is a word of Python's, so that this one is written as a table.
EvidenceRecord = TypedDict("EvidenceRecord", {"with": dict[str, str], "against": dict[str, str]}, total=False)


class Examined(Struct, frozen=True, omit_defaults=True):
    """How many pixels of each kind a check looked at; `judge.measurement.Kind` says what each kind is."""

    wide: Count = 0
    rounding: Count = 0
    epsilon: Count = 0
    wrong: Count = 0
    unexamined: Count = 0
    pixels: Count = 0  # all of them; in results.json left out where they are the image's

    @property
    def strict(self) -> int:
        """Return how many are left."""
        return 2 * self.pixels - sum(astuple(self))

    @property
    def counts(self) -> dict[str, int]:
        """Return all numbers by their names."""
        return {"pixels": self.pixels, "strict": self.strict, **asdict(self)}

    def __add__(self, other: "Examined") -> "Examined":
        """Return both ledgers as one."""
        return Examined(*map(add, astuple(self), astuple(other)))


class Measurement(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """One comparison of a stage's image with another's.

    What results.json leaves out is its default, but for what `compact.expand` puts back.
    """

    worst_ratio: Real = 0.0  # error / limit, inf where the limit is 0 and the error is not
    worst_error: Real | None = 0.0
    limit: Real | None = 0.0  # at the worst pixel
    pixel: tuple[int, int] | None = (0, 0)  # column, row
    ours: tuple[Real, ...] = ()
    theirs: tuple[Real, ...] = ()
    interior: int = field(default_factory=int)  # pixels within their limits that hit something (for `ray`, all such)
    wrong: int = 0  # pixels over their limits that no nearby problem explains
    explained: int = 0  # pixels over their limits that one does
    hit_miss: int = 0  # wrong pixels where one hits and the other misses or hits another object
    nan: int = 0
    inf: int = 0
    ulp: Real = 0.0  # the worst pixel's error in units in the last place of the reference, in the subject's precision
    mean_wrong: Real = 0.0  # the mean error of the wrong pixels that are off by a finite one
    metrics: dict[str, Real | None] = field(default_factory=dict)  # by name; they inform, and never decide
    range: tuple[Real, Real] | UnsetType = UNSET  # to which they are relative
    kinds: Any = None  # while it is judged: uint8 (height, width), each pixel's `judge.measurement.Kind`

    def recorded(self, *, values: bool) -> "Measurement":
        """Return it by the digits that a record keeps, without its kinds and, unless `values`, both renderers' values.

        The images have these; a failure's are told where it is.
        """
        names = ("worst_ratio", "worst_error", "limit", "mean_wrong", *(("ours", "theirs") * values))
        short: dict[str, Any] = {"ours": (), "theirs": ()} | {name: shortened(getattr(self, name)) for name in names}
        return replace(self, **short, ulp=shortened(self.ulp, 3), kinds=None)


class FactorGroup(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """The factors of the pixels of one shape under the same lights, a number for each channel, None where not lit."""

    shape: int
    lights: tuple[int, ...]  # all that the group's pixels see
    pixels: int
    off: list[Real | None]  # ours / theirs - 1
    sees: list[Real | None]  # the largest of these of a correct renderer, and so the smallest that can be seen
    fitted: int | None = (
        None  # the light whose own factor it is, out of several that overlap; None: all of them together
    )
    wide: bool = False  # of pixels alone whose limits are wide


class Leaning(Struct, frozen=True, kw_only=True):
    """To which side the pixels with wide limits are off by more than what they share, each different value once."""

    pixels: Count
    above: Count
    below: Count


class Bias(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """The factors that many pixels share at a stage of light."""

    ratio: Real  # the worst factor's distance from 1 over its limit
    sees: Real
    common: Real | None  # the middle one of the groups' factors, less 1: this case's word on what the run shares
    allowance: Real  # of a factor that a whole run may share: the constants' roundings and the output's step
    groups: list[FactorGroup] | None = None
    wide: Leaning | None = None
    continued: "Bias | None" = None  # given the subject's own previous stages, of which groups are told over a limit


class Check(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """The result of one stage of one renderer under test before one reference, as it is judged, written and read.

    results.json leaves out what stands in the group of a check, and what `compact.expand` puts back.
    """

    configuration: str = ""
    reference: str = ""
    stage: Stage = Stage.CAMERA
    outcome: Outcome = field(default=Outcome.PASS, name="verdict")
    reason: str = ""
    ratio: Real = field(default_factory=float)  # by a factory, so that a 0 is written
    end_to_end: Measurement | None = None
    continued: Measurement | None = None
    examined: Examined | None = None  # what became of every pixel, or camera entry; None until it is accounted for
    because: str | int = field(default_factory=str)  # the derivation of the limit
    cells: tuple[str, str] | None = None  # where wrong pixels are, as `cells_of` says
    evidence: EvidenceRecord | None = None  # of a failure: which references side with whom, and where
    stopped: bool = False  # not measured because a renderer's time was over
    finding: str | None = None  # the checked-in finding that explains it
    bias: Bias | None = None  # of light before the oracle
    # While it is judged:
    suspected: str | None = None  # the reference that is under suspicion, if not the one compared with
    abstains: bool = False  # undecided only because the reference declares not to see there, or did not answer

    @property
    def name(self) -> str:
        """Return by which words it is known among the checks of its case."""
        return f"{self.configuration} {self.reference} {self.stage}"

    @property
    def alone(self) -> bool:
        """Say whether the stage is wrong by itself; nothing comes before the camera that it could have been handed."""
        own = self.continued, self.bias and self.bias.continued
        ratios = [part.worst_ratio if isinstance(part, Measurement) else part.ratio for part in own if part is not None]
        return self.outcome is Outcome.FAIL and (self.stage is Stage.CAMERA or any(ratio > 1 for ratio in ratios))

    def recorded(self) -> "Check":
        """Return it as a run keeps it: by a few digits, without what only judging asks for."""
        failed = self.outcome is not Outcome.PASS
        parts = (None if part is None else part.recorded(values=failed) for part in (self.end_to_end, self.continued))
        short = dict(zip(("end_to_end", "continued"), parts, strict=True))
        return replace(self, **short, ratio=shortened(self.ratio), suspected=None, abstains=False)


JUDGING = {"Check": ("suspected", "abstains"), "Measurement": ("kinds",)}  # fields that are never written


def shortened(value: Any, digits: int = DIGITS) -> Any:
    """Return a number, or each of several, by the digits that a record keeps; anything else as it is."""
    if isinstance(value, tuple):
        return tuple(shortened(each, digits) for each in value)
    return float(f"{value:.{digits}g}") if isinstance(value, float) else value


class RenderRecord(TypedDict, total=False):
    """One renderer's images of a case."""

    renderer: str
    configuration: str | None
    image: str | None
    error: str | None
    cached: bool
    seconds: Seconds
    kernels: Seconds  # of the tracer: what the kernels of one launch ran, the median of `launches`
    launches: int


class UnsupportedRecord(TypedDict, total=False):
    """A stage that a renderer could not answer."""

    reference: str | None
    stage: str | None
    why: str | None


class NoteRecord(TypedDict, total=False):
    """Where a reference answers a slightly different question."""

    reference: str | None
    note: str


class ExpectationRecord(TypedDict, total=False):
    """A closed form of the case, held against one configuration's image."""

    because: str
    stage: str
    verdict: str
    measured: Any
    expected: Any
    limit: Any
    ratio: Number
    configuration: str


class ConventionRecord(TypedDict, total=False):
    """A convention that who stands alone may follow instead, and how many of its pixels that explains."""

    what: str
    explains: bool
    ratio: Number | None
    differing: int | None
    interior: int


class AdjudicationRecord(TypedDict, total=False):
    """One stage's answers of everybody against everybody."""

    baseline: str
    renderers: list[str]
    ratio: list[list[Number | None]]
    differing: list[list[int | None]]
    alone: str | None
    why: str
    conventions: list[ConventionRecord]


class ComparedCheckRecord(TypedDict):
    """A check of two runs: verdict and worst error over limit before and after, null where it was not made."""

    configuration: str
    reference: str
    stage: str
    before: list[Any] | None
    after: list[Any] | None
    factor: Number | None  # by how much the ratio grew


class ComparedRecord(TypedDict):
    """A case as an earlier run had it, in the report of two runs."""

    before: str
    pixels: int | None
    checks: list[ComparedCheckRecord]


class MasksRecord(TypedDict, total=False):
    """Which pixels of one configuration nearby problems explain: a byte per pixel, deflated, in base64."""

    configuration: str
    height: int
    width: int
    data: str


class RepeatedRecord(TypedDict, total=False):
    """What came of rendering a case once more: whether one configuration's answer was the same to the last bit."""

    configuration: str
    stage: str | None
    pixel: list[int] | None
    differing: int
    beyond: Number  # the largest difference over what two right renderers may differ by
    verdict: Verdict
    sentence: str


class CheckGroupRecord(TypedDict):
    """The checks of one renderer under test before one reference, as results.json has them: a check a stage."""

    configuration: str
    reference: str
    stages: dict[str, Check]  # without these three


class CaseFacts(TypedDict, total=False):
    """One case: who rendered it, and its verdict."""

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
    preview: str  # in the place of images that were left out; empty where it could not be drawn
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
    lost: list[str]  # who died or exceeded a limit, of programs that stay alive
    growth: Count  # bytes of memory a scene, where a program that stays alive grows from scene to scene
    notes: list[NoteRecord]
    dark: bool  # a user's scene of which no pixel is lit
    kinds: list[str]  # of a program under test: what kind of case it is, in words
    refused: bool  # by what the program declares, it cannot draw the scene
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
    """A case with everything that was checked."""

    checks: list[Check]


class WrittenCaseRecord(CaseFacts, total=False):
    """A case as results.json has it: what its checks have in common stands there once."""

    checks: list[CheckGroupRecord]
    because: dict[str, dict[str, int]]  # reference -> stage -> place of the limit's derivation, unless a check has one


# Of these a check may have come to nothing; the camera's have no measurement though they were made.
UNMEASURED = frozenset(Outcome) - MEASURED

# The sign test of factors that many pixels, or many cases, share.
CHANCE = 2e-9  # of accusing a correct renderer, for each group and channel
LEAST_DISTINCT = 30  # so many signs are all alike with a probability of 2^-29


def worst_ratio(case: CaseRecord) -> float | None:
    """Return the case's largest error over its limit, NaN counted as largest; None without any.

    What a list has of a case holds it already.
    """
    return number(case["worst_ratio"]) if "worst_ratio" in case else worst_of(case.get("checks", []))


def worst_of(checks: Iterable[Check]) -> float | None:
    """Return the largest error over its limit of some checks, NaN counted as largest; None without any."""
    known = [at_worst(ratio) for check in checks if (ratio := ratio_of(check)) is not None]
    return max(known, default=None)


def ratio_of(check: Check) -> float | None:
    """Return a check's error over its limit: the larger one where it was judged twice.

    None where nothing was measured, for which results.json has the ratio 0.
    """
    return check.ratio if check.end_to_end or check.continued or check.outcome not in UNMEASURED else None


def least_share(distinct: int) -> float:
    """Return the share of a sample below its median that chance leaves on either side of it, but for `CHANCE`.

    Of so many independent signs at most half are expected to be positive; Hoeffding's inequality (1963, theorem 1).
    """
    return max(0.0, 0.5 - math.sqrt(math.log(2 / CHANCE) / (2 * distinct)))
