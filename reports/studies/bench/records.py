"""What `rayproof bench --json` writes, one class a level, as docs/bench.md describes it. Times are in milliseconds."""

from typing import NotRequired, TypedDict

Interval = list[float]  # the two ends of a 95 % interval


class PeakRates(TypedDict):
    """What the machine does a second at most in one precision, over all threads."""

    operations_per_second: float
    divisions_per_second: float
    roots_per_second: float


class MachineRecord(TypedDict):
    """The peaks of a machine; Gflop/s count a fused multiplication and addition as two."""

    threads: int
    fma_gflops: float
    fma_float64_gflops: float
    float32: PeakRates
    float64: PeakRates
    write_bytes_per_second: float


class LimitRecord(TypedDict):
    """How near our kernels come to the peaks; None where nobody counted how often their code runs."""

    limit_fraction: float | None
    limit_by: str | None  # "operations", "divisions" or "writes"
    limit_sum_fraction: float | None


class ErrorRecord(TypedDict):
    """How far a picture is from the oracle's in the pixels that were looked at."""

    median: float  # relative, of the pixels that both find lit
    p99: float
    pixels: int  # that both find lit
    disagree: int  # pixels that one alone finds lit


class ContenderRecord(TypedDict, total=False):
    """A contender on one scene: its times, or why it is left out."""

    left_out: str
    does: str
    ms: float
    fastest_ms: float
    rounds: int
    first_ms: float
    build_ms: float
    error: ErrorRecord | None


class RatioRecord(TypedDict):
    """The time of the fastest of some contenders over ours."""

    ratio: float
    interval: Interval
    by: str


class SceneRecord(LimitRecord):
    """What was measured of one scene at one size."""

    name: str
    about: str
    width: int  # px
    height: int  # px
    lights: int
    ours_ms: float
    minimal_ms: float | None
    direct_ms: float | None
    ratio_minimal: float | None
    ratio_minimal_interval: Interval | None
    ratio_minimal_by: str | None
    ratio_direct: float | None
    ratio_direct_interval: Interval | None
    control: float | None
    control_interval: Interval | None
    default: NotRequired[float]  # the default formulas' time over those of the formulas asked about
    default_interval: NotRequired[Interval]
    pixels_differ: float | None  # share
    error: ErrorRecord | None
    compile_ms: float
    build_ms: float
    kernel_ms: float
    operations: float
    contenders: dict[str, ContenderRecord]


class ChangeRecord(TypedDict):
    """How a scene's time changed since an earlier benchmark."""

    name: str
    width: int  # px
    height: int  # px
    change: float  # factor of the time
    interval: Interval
    control_interval: Interval | None
    verdict: str


class BenchRecord(TypedDict):
    """A benchmark."""

    schema: int
    started: str  # ISO 8601
    versions: dict[str, str]
    machine: MachineRecord
    scenes: list[SceneRecord]
    formulas: NotRequired[str]
    changes: NotRequired[list[ChangeRecord]]
