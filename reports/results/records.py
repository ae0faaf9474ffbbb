"""Records of a run, one class per level: the content of results.json; validation of documents, and their JSON Schema.

The records are dictionaries with declared keys, since they are written to JSON and read from it. msgspec validates
documents against them (`problem`) and derives the JSON Schema that `rayproof list schema results` prints.
docs/results.md explains each key. Keys that a class does not declare are allowed and preserved.
"""

import re
from collections.abc import Mapping, Sequence
from functools import cache
from typing import Annotated, Any, Literal, NotRequired, Required, TypedDict

import msgspec
from msgspec import Meta

from rayproof.reports.results.case_records import (
    JUDGING,
    CaseRecord,
    ComparedCheckRecord,
    Count,
    Number,
    Seconds,
    Verdict,
    WrittenCaseRecord,
)
from rayproof.reports.results.files import SCHEMA, plain
from rayproof.reports.results.outcomes import Outcome

MOST_SHARDS = 10_000

# "pass" is a keyword of Python, so that this type needs the functional syntax.
LedgerRecord = TypedDict(
    "LedgerRecord",
    {
        "planned": Count,
        "pass": Count,
        "warn": Count,
        "undecided": Count,
        "unsupported": Count,
        "missing": Count,
        "reference_suspect": Count,
        "error": Count,
        "fail": Count,
    },
)


class ComparisonRowRecord(TypedDict, total=False):
    """The changes of one case between two runs."""

    case: Required[str]
    before: str
    after: str
    stage: str | None
    worst: ComparedCheckRecord | None
    decades: float
    seconds: list[Number | None]
    stands_out: int
    pixels: int | None
    checks: list[ComparedCheckRecord]


class ComparedRunRecord(TypedDict, total=False):
    """The facts about each run in the report of two runs."""

    name: str
    command: str | None
    started: str | None
    rayproof: str | None
    verdict: str | None


class ComparisonRecord(TypedDict, total=False):
    """The comparison of a run with an earlier run."""

    base: ComparedRunRecord
    candidate: ComparedRunRecord
    faults: list[str]
    configurations: dict[str, str]
    shared: int
    time: float | None
    appeared: list[list[str]]
    vanished: list[list[str]]
    rows: list[ComparisonRowRecord]
    renderers: dict[str, str]
    sentence: str


class ReferenceRecord(TypedDict, total=False):
    """A reference of the run."""

    version: str
    precision: str
    independent: bool


class CoverageRecord(TypedDict, total=False):
    """The number of measurements of an item of the specification, and the largest error over its limit."""

    cases: int
    failed: int
    worst_ratio: Number | None
    worst_check: str | None
    references: list[str]


class CommonFactorRecord(TypedDict, total=False):
    """The factor that a whole run shares at one stage of light."""

    configuration: str
    stage: str
    off: Number | None
    sees: Number | None
    voices: int
    cases: int
    verdict: Verdict


class WideLimitsRecord(TypedDict):
    """A `Leaning` of a whole run, for one configuration and stage of light; each camera and its lights count once."""

    configuration: str
    stage: str
    pixels: Count
    above: Count
    below: Count
    verdict: Verdict


class ExplainedRecord(TypedDict):
    """The number of cases that a cause explains, and the number of all cases."""

    cases: int
    of: int


class AlternativeRecord(TypedDict, total=False):
    """A mistake that produces the same pixels in this run as the reported mistake."""

    mistake: str
    sentence: str
    items: list[str]
    parameters: dict[str, Number]


CauseRecord = TypedDict(
    "CauseRecord",
    {
        "mistake": str | None,
        "items": list[str],
        "sentence": str,
        "explains": ExplainedRecord,
        "cases": list[str],
        "with": list[str],
        "alternatives": list[AlternativeRecord],
        "told_apart_by": str | None,
        "predicted": ExplainedRecord | None,
        "parameters": dict[str, Number],
        "tried": int,
    },
    total=False,
)


class AnsweredRecord(TypedDict, total=False):
    """The numbers of answered and planned checks, without the checks for which the protocol has no channel."""

    checks: Count
    planned: Count
    stages: list[str]  # the stages with an answered check, in the order of the stages
    families: dict[str, tuple[Count, Count]]  # checks answered, and planned
    left_out: list[str]  # sentences about subjects that answer some cases of a kind and leave out others
    cases: Count  # the number of cases with a judged stage that the subject wrote
    planned_cases: Count


class DeclaredRecord(TypedDict, total=False):
    """The declarations of a program under test."""

    name: str
    stages: list[str]
    world_normals: bool


# The lists of a `GateRecord` that make the gate red, the most informative first.
SHUTTING = ("regressions", "worse", "uncovered", "tighten", "stale", "expired")


class GateRecord(TypedDict):
    """The comparison of a run with the expected failures, and with an earlier run."""

    file: str
    sentence: str
    red: bool
    regressions: list[str]
    tighten: list[str]
    stale: list[str]
    expired: list[str]
    matched: list[str]
    cases: list[str]
    worse: NotRequired[list[str]]
    uncovered: NotRequired[list[str]]
    mended: NotRequired[list[str]]  # cases that failed in an earlier run, and pass now


class RefusedRecord(TypedDict):
    """A worker that refused work, or failed to do it."""

    id: str
    why: str


class EngineRecord(TypedDict):
    """The cluster that computed a run's cases."""

    name: str
    version: str
    refused: list[RefusedRecord]


class ShardRecord(TypedDict):
    """The number of a shard of a run, and the digests by which shards of one plan recognise each other."""

    number: Annotated[int, Meta(ge=1, le=MOST_SHARDS)]
    of: Annotated[int, Meta(ge=1, le=MOST_SHARDS)]
    planned: Count  # cases of the whole run
    names: str  # a digest of the names of the shard's cases
    configurations: list[str]  # of the whole run
    code: str
    plan: str
    subject: str
    demands: str
    out: str  # the folder, as the command named it
    require: list[str]
    diagnose: bool
    keep_images: NotRequired[str]  # the option's value


class MergedRecord(TypedDict):
    """A shard that was merged into a run."""

    number: Count
    of: Count
    cases: Count


class ReviewRecord(TypedDict, total=False):
    """A limit that should be reviewed."""

    check: str
    ratio: Number
    why: str


class ImagesKeptRecord(TypedDict):
    """The numbers of cases with images, of passing cases without images, and of other cases with only a preview."""

    cases: Count
    left_out: Count
    previews: NotRequired[Count]


class FindingRecord(TypedDict, total=False):
    """A finding about a reference, and the checks of this run that it explained."""

    name: str
    reference: str
    version: str
    stage: str
    where: str
    at_least: float
    smallest_scene: str
    command: str
    third_witness: str
    what: str
    met: list[str]


class WorseRecord(TypedDict):
    """A quantity of a case that is worse than in its history (verdict, error, wrong pixels or time), and the factor."""

    case: str
    what: str
    factor: Number
    sentence: str


class HistoryRecord(TypedDict):
    """A run in its history of earlier runs, with each case's last points, which the report draws."""

    file: str
    run: int
    worse: list[WorseRecord]
    # run, revision, verdict, error over limit, seconds
    cases: Mapping[str, Sequence[tuple[int, str, str, Number | None, Number]]]


class RunFacts(TypedDict, total=False):
    """A whole run without its cases."""

    schema: Required[Literal[1]]
    rayproof: str
    command: str
    started: str
    seconds: Seconds
    verdict: Verdict
    finished: bool
    subject: str
    faults: list[str]
    environment: dict[str, str]
    configurations: list[str]
    references: dict[str, ReferenceRecord] | None
    absent: dict[str, str] | None
    abstained: dict[str, dict[str, str]] | None
    stopped: dict[str, list[str]]
    summary: Required[LedgerRecord]
    checks: Required[LedgerRecord]
    least_coverage: Number  # %, of the cases that must be answered
    answered: AnsweredRecord
    declared: DeclaredRecord
    examined: dict[str, Count] | None
    examined_passing: dict[str, Count] | None
    common_factors: list[CommonFactorRecord]
    wide_limits: list[WideLimitsRecord]
    wrong_factors: list[str]
    changing: list[str]
    growing: list[str]
    gate: GateRecord
    engine: EngineRecord
    shard: ShardRecord  # only of a shard of a run
    shards: list[MergedRecord]  # only of a run that was merged from shards
    diagnosis: list[CauseRecord]
    comparison: ComparisonRecord  # only of a run that is compared with an earlier run
    history: HistoryRecord  # added if the run is published with its history
    coverage: Required[dict[str, Count]]
    coverage_detail: dict[str, CoverageRecord]
    images_kept: ImagesKeptRecord
    review: list[ReviewRecord]
    findings: list[FindingRecord]
    derivations: list[str]


class RunRecord(RunFacts, total=False):
    """A whole run."""

    cases: Required[list[CaseRecord]]


class WrittenRunRecord(RunFacts, total=False):
    """A whole run in the format of results.json."""

    cases: Required[list[WrittenCaseRecord]]


# Names of JSON types: msgspec's name -> words.
_WORDS = {
    "object": "an object", "array": "a list", "str": "a text", "int": "a whole number", "float": "a number",
    "bool": "true or false", "null": "null",
}  # fmt: skip
LONGEST = 80  # characters of a bad value that are shown


def problem(document: Any) -> str | None:
    """Return a sentence with the first invalid field of a results.json and its value, or None if it is valid."""
    return _problem(document, WrittenRunRecord)


def problem_of_case(record: Any) -> str | None:
    """Return a sentence with the first invalid field of a `CaseRecord` and its value, or None if it is valid."""
    return _problem(record, CaseRecord)


def _problem(document: Any, kind: Any) -> str | None:
    try:
        msgspec.convert(document, kind)
    except msgspec.ValidationError as error:
        message, _, place = str(error).partition(" - at `")
        return _sentence(message, place.rstrip("`").removeprefix("$").removeprefix("."), document)
    except UnicodeEncodeError:
        return "a text in the document is no Unicode"
    return None


def _sentence(message: str, place: str, document: Any) -> str:
    if missing := re.fullmatch("Object missing required field `(.*)`", message):
        return f"{place + '.' if place else ''}{missing[1]} is missing"
    if message.startswith("Invalid enum value") and place == "schema":
        wanted = str(SCHEMA)
    elif message.startswith("Invalid enum value") and not place.endswith("verdict"):
        wanted = "a number"
    elif "matching regex" in message or message.startswith("Invalid enum value"):
        wanted = f"one of {', '.join(Outcome)}"
    elif "length" in message:
        wanted = "a list of another length" if "array" in message else "a non-empty text"
    elif "out of range" in message:
        wanted = "a number that fits 64 bits"
    elif limit := re.search(r"(>=|<=) (\S+)", message):
        wanted = f"a number {limit[1]} {float(limit[2]):g}"
    else:
        kinds = re.search(r"`([^`]*)`", message)
        wanted = " or ".join(_WORDS.get(kind, kind) for kind in (kinds[1].split(" | ") if kinds else ["otherwise"]))
    got = (
        "" if "[...]" in place else f", got {_shown(_at(document, place))}"
    )  # msgspec's path lacks the keys of objects
    return f"{place or 'the document'} must be {wanted}{got}"


def _at(document: Any, place: str) -> Any:
    """Return the value at a path such as `cases[1].verdict`, or at the longest part of the path that exists."""
    for step in re.findall(r"[^.\[\]]+", place):
        try:
            document = document[int(step) if isinstance(document, list | tuple) else step]
        except (KeyError, IndexError, ValueError, TypeError):
            break
    return document


def _shown(value: Any) -> str:
    if not (value is None or isinstance(value, str | int | float) or not value):
        return type(value).__name__
    text = repr(value)
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 3]}..."


@cache
def schema() -> dict[str, Any]:
    """Return the JSON Schema (2020-12) of results.json."""
    document = plain(msgspec.json.schema(WrittenRunRecord))  # its tuples are lists
    for name, fields in JUDGING.items():
        for key in fields:
            del document["$defs"][name]["properties"][key]
    return document
