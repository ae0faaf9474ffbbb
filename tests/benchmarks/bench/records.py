"""What `--json` writes, and whether it is slower than before. Times are in ms."""

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


# Is today slower than an earlier benchmark: by Mitsuba's minimal kernel as common yardstick, beside an A/A control.
#
# Milliseconds of two days are not comparable, but the ratio of two programs that ran in turns is. A scene counts as
# slower if the intervals of its ratio to the minimal kernel do not overlap and the change exceeds what the control, the
# same code against itself, shows today.


def compared(old: BenchRecord, new: BenchRecord) -> list[ChangeRecord]:
    """Return each scene that both have: how the time changed, and a verdict: slower, faster, or no difference shown."""
    before = {_key(entry): entry for entry in old.get("scenes", [])}
    found = []
    for entry in new["scenes"]:
        earlier = before.get(_key(entry))
        if earlier is None:
            continue
        then, now = earlier.get("ratio_minimal"), entry.get("ratio_minimal")
        bounds_then, bounds_now = earlier.get("ratio_minimal_interval"), entry.get("ratio_minimal_interval")
        if not then or not now or not bounds_then or not bounds_now:
            continue
        change = then / now
        (old_low, old_high), (low, high) = bounds_then, bounds_now
        control = entry.get("control_interval")
        noise = max(abs(bound - 1) for bound in control) if control else 0.0
        verdict = "no difference shown"
        if high < old_low and change > 1 + noise:
            verdict = "slower"
        elif low > old_high and change < 1 / (1 + noise):
            verdict = "faster"
        found.append(
            {
                "name": entry["name"],
                "width": entry["width"],
                "height": entry["height"],
                "change": change,
                "interval": [old_low / high, old_high / low],
                "control_interval": control,
                "verdict": verdict,
            }
        )
    return found


def _key(entry: SceneRecord) -> tuple[str | None, int | None, int | None]:
    return entry.get("name"), entry.get("width"), entry.get("height")
