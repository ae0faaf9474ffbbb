"""Records of a case and its checks, one class a level; the largest error over its limit; a sign test of factors.

docs/results.md explains each key. The sign test gives what chance makes of factors that many pixels or cases share.
"""

import math
from collections.abc import Iterable
from typing import Annotated, Any, Literal, Required, TypedDict

from msgspec import Meta

from rayproof.reports.results.files import at_worst, number
from rayproof.reports.results.outcomes import MEASURED, Outcome

BY_LAWS = "laws"  # where a check's reference stands if laws made it: they render the subject again
MOST_SECONDS = 1e12  # s that a run may have taken; thousandths of it are still numbers of 64 bits
Number = float | Literal["inf", "-inf", "nan"]  # JSON has no other numbers
Count = Annotated[int, Meta(ge=0)]
Name = Annotated[str, Meta(min_length=1)]
Seconds = Annotated[float, Meta(ge=-MOST_SECONDS, le=MOST_SECONDS)]
Verdict = Annotated[str, Meta(pattern=f"^({'|'.join(Outcome)})$")]

# "with" is a word of Python's, so that this one is written as a table.
EvidenceRecord = TypedDict("EvidenceRecord", {"with": dict[str, str], "against": dict[str, str]}, total=False)


class ExaminedRecord(TypedDict):
    """What became of the pixels that checks looked at; `pixels` is the sum of the rest."""

    pixels: Count
    strict: Count
    wide: Count
    side: Count
    interval: Count
    epsilon: Count
    wrong: Count
    unexamined: Count


class MeasurementRecord(TypedDict, total=False):
    """One comparison of a stage's image with another's."""

    worst_ratio: Number | None
    worst_inside: Number | None
    worst_error: Number | None
    limit: Number | None
    pixel: list[int] | None
    ours: list[Number]
    theirs: list[Number]
    interior: int
    over_inside: int
    edge: int
    differ_at_edge: int
    wrong_at_edge: int
    in_window: int
    differ_in_window: int
    hit_miss: int
    nan: int
    inf: int
    flagged: int
    ulp: Number | None
    mean_wrong: Number  # left out where no pixel is wrong
    relative_mse: Number | None
    ssim: Number | None
    psnr: Number | None
    nrmse: Number | None
    range: list[Number] | None


class FactorGroupRecord(TypedDict, total=False):
    """The factors of the pixels of one shape under the same lights, a number for each channel, null where not lit."""

    shape: int
    lights: list[int]
    fitted: int
    wide: bool
    pixels: int
    off: list[Number | None]
    sees: list[Number | None]


class LeaningRecord(TypedDict):
    """How many pixels have wide limits, and how many are off to either side by more than pixels share."""

    pixels: Count
    above: Count
    below: Count


class BiasRecord(TypedDict, total=False):
    """The factors that many pixels share."""

    ratio: Number
    sees: Number
    common: Number | None
    allowance: Number
    groups: list[FactorGroupRecord]
    wide: LeaningRecord
    continued: Any  # a `BiasRecord` again, given the candidate's own previous stages


class CheckFacts(TypedDict, total=False):
    """What one stage of one renderer under test came to before one reference."""

    stopped: bool
    configuration: str
    reference: str
    stage: str
    ratio: Number
    reason: str | None
    evidence: EvidenceRecord | None  # witness to the stage at which it sides with, or against, who is under test
    finding: str | None
    end_to_end: MeasurementRecord | None
    continued: MeasurementRecord | None
    examined: dict[str, Count] | None
    cells: list[str]  # of an 8 x 8 grid: which hold wrong pixels, and which do so or lie within a pixel of one
    bias: BiasRecord | None
    because: str | int


class CheckRecord(CheckFacts, total=False):
    """The same with its verdict."""

    verdict: Required[Verdict]


class WrittenCheckRecord(CheckFacts, total=False):
    """A check as results.json has it: without what `results.compact` puts back when it is read."""

    verdict: Verdict  # left out where it is `pass`


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
    """Which pixels may differ, for one configuration before the oracle: a byte a pixel, deflated, in base64."""

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


class LawRecord(TypedDict, total=False):
    """What one law says of one configuration, by the renderer's own images of the case's scene and of changed ones."""

    law: str
    configuration: str
    verdict: Verdict
    relations: Count  # examined
    ill_conditioned: Count  # whose limit is too wide to tell anything
    excused: Count  # pixels
    worst_ratio: Number
    reason: str


class CheckGroupRecord(TypedDict):
    """The checks of one renderer under test before one reference, as results.json has them: a check a stage."""

    configuration: str
    reference: str
    stages: dict[str, WrittenCheckRecord]


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
    call: str | None
    scene: str | None
    picture: str | None
    thumbnail: str | None
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
    laws: list[LawRecord]
    versions: dict[str, str]
    remembered: bool
    worker: str
    key: str
    seconds: Seconds
    judge_seconds: Seconds


class CaseRecord(CaseFacts, total=False):
    """A case with everything that was checked."""

    checks: list[CheckRecord]


class WrittenCaseRecord(CaseFacts, total=False):
    """A case as results.json has it: what its checks have in common stands there once."""

    checks: list[CheckGroupRecord]
    because: dict[str, dict[str, int]]  # reference -> stage -> place of the limit's derivation, unless a check has one


def by_references(case: CaseRecord) -> list[CheckRecord]:
    """Return the checks that compare the case's own images, and not the renderer with itself on other scenes."""
    return [check for check in case.get("checks", []) if check.get("reference") != BY_LAWS]


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


def worst_of(checks: Iterable[CheckRecord]) -> float | None:
    """Return the largest error over its limit of some checks, NaN counted as largest; None without any."""
    known = [at_worst(ratio) for check in checks if (ratio := number(ratio_of(check))) is not None]
    return max(known, default=None)


def ratio_of(check: CheckRecord) -> Any:
    """Return a check's error over its limit as results.json has it: the larger one where it was judged twice.

    None where nothing was measured, for which results.json has the ratio 0.
    """
    measured = check.get("end_to_end") or check.get("continued")
    if not measured and check.get("verdict") in UNMEASURED:
        return None
    return check.get("ratio", (check.get("end_to_end") or {}).get("worst_ratio"))


def least_share(distinct: int) -> float:
    """Return the share of a sample below its median that chance leaves on either side of it, but for `CHANCE`.

    Of so many independent signs at most half are expected to be positive; Hoeffding's inequality (1963, theorem 1).
    """
    return max(0.0, 0.5 - math.sqrt(math.log(2 / CHANCE) / (2 * distinct)))
