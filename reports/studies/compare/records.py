"""What `rayproof compare --json` writes, one class a level, as docs/compare.md describes it."""

from typing import TypedDict, final

from rayproof.reports.studies.compare.statistics import Interval


class SignsRecord(TypedDict):
    """What surely changed in a family: 1 for the better, -1 for the worse, 0 where neither is shown."""

    decisions: int
    typical: int
    tail: int


class WrongRecord(TypedDict):
    """How many pixels are decided wrongly, by whom."""

    base: int
    candidate: int
    only_base: int
    only_candidate: int
    p: float  # that the two decide wrongly alike


class TailRecord(TypedDict):
    """How a family's pixels lean; see `compare.tails.Tail`."""

    better: int
    worse: int
    tiles_better: int
    tiles_worse: int
    scenes: int
    p: float


class ErrorsRecord(TypedDict):
    """How far off one contender is at one stage; nothing where it decides no pixel rightly."""

    scaled: dict[str, float]  # median, p99, worst -> error / (K u)
    natural: dict[str, float]
    unit: str


class ErrorsPair(TypedDict):
    """How far off the two are."""

    base: ErrorsRecord
    candidate: ErrorsRecord


class FamilyRecord(TypedDict):
    """One family."""

    family: str
    stress: bool
    outcome: str
    changed: SignsRecord
    scenes: int
    pixels: int
    same_inputs: bool
    digits_gained: float | None  # of a stage that is only right or wrong there are none
    digits_interval: Interval | None
    share_better: float
    share_worse: float
    wrong: WrongRecord
    tail: TailRecord
    errors: dict[str, ErrorsPair]  # by stage
    time_ratio: float
    time_interval: Interval
    nanoseconds_per_ray: tuple[float, float]  # of the base, of the candidate
    compile_seconds: tuple[float, float]


class ComparedAbout(TypedDict):
    """Who was compared with whom, and how."""

    base: str
    candidate: str
    configurations: list[str]
    faults: list[str]  # planted ones in use
    stages: list[str]
    level: float  # of the intervals
    repetitions: int


class SideRecord(TypedDict):
    """What is said of somebody beside the base."""

    verdict: str
    outcome: str
    digits_gained: float | None
    digits_interval: Interval | None
    time_ratio: float
    time_interval: Interval
    families: list[FamilyRecord]


class ControlRecord(SideRecord):
    """The base against itself."""

    families_outside: int  # whose time interval excludes 1


@final
class FormulaComparison(ComparedAbout, SideRecord):
    """Two formulas or configurations."""

    control: ControlRecord


class CaseMove(TypedDict):
    """A case of two runs."""

    case: str
    family: str
    before: str  # its verdict
    after: str
    digits_gained: float | None
    check: str  # that changed most
    seconds: list[float]  # that the tracer took before and after


class FamilyMove(TypedDict):
    """A family of two runs."""

    family: str
    digits_gained: float | None
    changed: int  # cases with another verdict


@final
class RunComparison(TypedDict):
    """Two finished runs."""

    base: str
    candidate: str
    configurations: list[list[str]]
    faults: list[str]
    verdict: str
    outcome: str
    digits_gained: float | None
    digits_interval: Interval | None
    time_ratio: float | None
    time_interval: Interval | None
    control: None
    families: list[FamilyMove]
    shared: int  # cases
    only_base: list[str]
    only_candidate: list[str]
    changed: list[CaseMove]
