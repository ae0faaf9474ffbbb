"""`TradeoffPoint`: error and time with intervals; the Pareto front, interleaved timing, tails, records."""

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypedDict

import drjit as dr
import numpy as np

from rayproof.reports.results.provenance import Origin
from rayproof.reports.studies.compare.statistics import (
    FEWEST,
    LEVEL,
    Interval,
    median_interval,
    percentile_interval,
    too_few,
)

GAIN = 1.01  # an error that is less than a hundredth smaller buys no place on the front
MOST_WRONG = 1e-3  # share of pixels decided wrongly beyond which a point is wrong; the ladders' usual gate


@dataclass(frozen=True, kw_only=True)
class TradeoffPoint:
    """One renderer, configured somehow, on one family: what a ray costs and how far off it is."""

    diagram: str
    label: str  # what tells it from the other points of the diagram
    renderer: str  # "tracer", "mitsuba_llvm", ...
    variant: str  # the formula, or "" where none is named
    precision: str
    samples: int  # per pixel
    kind: str  # "right", "control", or "reference"
    clock: str  # "kernels" or "wall"
    error: float  # what the diagram's axis says
    error_interval: Interval
    natural: float | None  # the same tail in natural units
    unit: str
    wrong: float  # share of pixels decided wrongly
    nanoseconds: float = math.nan  # per ray
    nanoseconds_interval: Interval = (math.nan, math.nan)

    @property
    def key(self) -> tuple[str, str]:
        """Return what names the point among all points."""
        return self.diagram, self.label


def front(points: Sequence[TradeoffPoint]) -> tuple[TradeoffPoint, ...]:
    """Return the Pareto front by time: points that no other beats in one of time and error without losing the other.

    A point that decides more pixels wrongly beats none. Controls, known to be wrong somewhere, points that decide more
    than `MOST_WRONG` of the pixels wrongly, and points without an error are not on it.
    """

    def beats(one: TradeoffPoint, other: TradeoffPoint) -> bool:
        if one.wrong > other.wrong:
            return False
        faster = one.nanoseconds < other.nanoseconds and one.error <= other.error * GAIN
        nearer = one.nanoseconds <= other.nanoseconds and one.error * GAIN < other.error
        return faster or nearer

    measured = [one for one in points if math.isfinite(one.error) and one.kind != "control" and one.wrong <= MOST_WRONG]
    ahead = [one for one in measured if not any(beats(other, one) for other in measured)]
    return tuple(sorted(ahead, key=lambda one: (one.nanoseconds, one.label)))


def without_error(point: dict[str, Any]) -> str:
    """Return in words why a point has no error, or an empty string: no pixel, or none of some, is decided rightly."""
    if math.isfinite(point["error"]):
        return ""
    return "all wrong" if point["wrong"] >= 1 else f"no error, {100 * point['wrong']:.2g} % wrong"


class DiagramRecord(TypedDict):
    """A work-precision diagram: which points it has, and the labels of those on its Pareto front."""

    name: str
    kind: str
    svg: str  # file name
    time_axis: str
    error_axis: str
    front: list[str]
    points: list[dict[str, Any]]  # as `point_record` returns them


class TradeoffRecord(TypedDict):
    """What tradeoff.json holds."""

    schema: int
    environment: dict[str, str]
    origin: Origin
    repetitions: int
    seconds: float
    diagrams: list[DiagramRecord]


def point_record(point: TradeoffPoint, *, on_front: bool) -> dict[str, Any]:
    """Return a point as docs/compare.md describes it; bounds are those of 95 % intervals."""
    return {
        "diagram": point.diagram,
        "label": point.label,
        "renderer": point.renderer,
        "variant": point.variant,
        "precision": point.precision,
        "samples": point.samples,
        "kind": point.kind,
        "nanoseconds": point.nanoseconds,
        "nanoseconds_low": point.nanoseconds_interval[0],
        "nanoseconds_high": point.nanoseconds_interval[1],
        "clock": point.clock,
        "error": point.error,
        "error_low": point.error_interval[0],
        "error_high": point.error_interval[1],
        "natural": point.natural,
        "unit": point.unit,
        "wrong": point.wrong,
        "front": on_front,
    }


# Seconds of renderers that are no formula of ours, and the interleaving of everything that is to be timed.


Launch = Callable[[], float]  # runs once and returns its seconds


def kernel_seconds(run: Callable[[], object]) -> float:
    """Return how long the kernels ran that `run` launched through Dr.Jit, whoever wrote them [s]."""
    before = dr.flag(dr.JitFlag.KernelHistory)
    dr.set_flag(dr.JitFlag.KernelHistory, True)
    try:
        dr.kernel_history_clear()
        run()
        dr.sync_thread()
        return sum(kernel["execution_time"] for kernel in dr.kernel_history([dr.KernelType.JIT])) * 1e-3
    finally:
        dr.set_flag(dr.JitFlag.KernelHistory, before)


def wall_seconds(run: Callable[[], object]) -> float:
    """Return how long `run` took [s]."""
    start = time.perf_counter()
    run()
    return time.perf_counter() - start


def interleave(launches: Sequence[Launch], *, repetitions: int, budget: float) -> list[np.ndarray]:
    """Return the seconds of each launch in warm repetitions, all visited in a new order each time.

    A launch that would keep us longer than `budget` [s] in all, whatever its own clock says, is repeated less often, an
    odd number of times, and never less often than an interval takes.

    Raises:
        ValueError: there are fewer repetitions than that.

    """
    if repetitions < FEWEST:
        raise ValueError(too_few(repetitions))
    for launch in launches:
        launch()
    warm = [wall_seconds(launch) for launch in launches]
    counts = [max(FEWEST, min(repetitions, int(budget / seconds))) | 1 for seconds in warm]
    seconds: list[list[float]] = [[] for _ in launches]
    generator = np.random.default_rng(6)
    for repetition in range(max(counts, default=0)):
        for index in generator.permutation(len(launches)):
            if repetition < counts[index]:
                seconds[index].append(launches[index]())
    return [np.array(found) for found in seconds]


# A point whose error is known and whose time is still to be taken.


@dataclass(frozen=True, kw_only=True)
class UntimedPoint:
    """A point and how to time it; until then its nanoseconds are NaN."""

    point: TradeoffPoint
    launch: Launch
    rays: int  # of a launch; pixels where samples are compared

    def timed(self, seconds: np.ndarray) -> TradeoffPoint:
        """Return the point, given the seconds of an odd number of launches."""
        each = seconds / self.rays * 1e9
        interval = median_interval(each.tolist(), level=LEVEL)
        return replace(self.point, nanoseconds=float(np.median(each)), nanoseconds_interval=interval)


# Tails of errors with their intervals: what a diagram's vertical axis shows.


TAIL = 0.99  # of the pixels; the worst of all cannot be estimated, only met
TILE = 32  # neighbouring pixels that are drawn again together
REPLICATES = 200
# An error of exactly 0 has no place on a logarithmic axis; float64's roundoff is 2^-29 of float32's.
LEAST = 2.0**-40
SEED = 5


def tail(scenes: Sequence[np.ndarray]) -> tuple[float, Interval]:
    """Return the 99 % quantile of the scenes' errors (NaN left out) and its bootstrap interval, tiles drawn again."""
    values = [scene[np.isfinite(scene)] for scene in scenes]
    tiles = [run for scene in values for run in np.array_split(scene, max(1, len(scene) // TILE)) if len(run)]
    if not tiles:
        return float("nan"), (float("nan"), float("nan"))
    generator = np.random.default_rng(SEED)
    replicates = np.array(
        [
            np.quantile(
                np.concatenate([tiles[index] for index in generator.integers(len(tiles), size=len(tiles))]), TAIL
            )
            for _ in range(REPLICATES)
        ]
    )
    low, high = percentile_interval(replicates, level=LEVEL)
    at = quantile(scenes)
    return max(at, LEAST), (max(min(low, at), LEAST), max(high, at, LEAST))


def quantile(scenes: Sequence[np.ndarray]) -> float:
    """Return the 99 % quantile of the scenes' errors; NaN are left out, and NaN is the answer where nothing is left."""
    values = np.concatenate([scene[np.isfinite(scene)] for scene in scenes])
    return float(np.quantile(values, TAIL)) if len(values) else float("nan")


def root_mean_square(image: np.ndarray, truth: np.ndarray) -> tuple[float, Interval]:
    """Return the RMSE of two images (height, width, channels) over the truth's mean, rows of pixels drawn again."""
    squares = ((image - truth) ** 2).mean(axis=(1, 2))
    scale = float(np.abs(truth).mean()) or 1.0
    drawn = np.random.default_rng(SEED).integers(len(squares), size=(REPLICATES, len(squares)))
    low, high = percentile_interval(np.sqrt(squares[drawn].mean(axis=1)), level=LEVEL)
    at = float(np.sqrt(squares.mean()))
    return max(at / scale, LEAST), (max(low / scale, LEAST), max(high / scale, LEAST))
