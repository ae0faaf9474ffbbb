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

GAIN = 1.01  # a point is on the front only if its error is smaller by at least a hundredth
MOST_WRONG = 1e-3  # largest share of wrongly decided pixels of a point on the front; the ladders' usual gate


@dataclass(frozen=True, kw_only=True)
class TradeoffPoint:
    """The error and the run time per ray of one renderer in one configuration on one family."""

    diagram: str
    label: str  # unique within the diagram
    renderer: str  # "tracer", "mitsuba_llvm", ...
    variant: str  # the formula, or "" for whole images and other renderers
    precision: str
    samples: int  # per pixel
    kind: str  # "right", "control", or "reference"
    clock: str  # "kernels" or "wall"
    error: float  # the quantity on the diagram's error axis
    error_interval: Interval
    natural: float | None  # the same tail in natural units
    unit: str
    wrong: float  # share of pixels decided wrongly
    nanoseconds: float = math.nan  # per ray
    nanoseconds_interval: Interval = (math.nan, math.nan)

    @property
    def key(self) -> tuple[str, str]:
        """Return the key of the point, unique among all points."""
        return self.diagram, self.label


def front(points: Sequence[TradeoffPoint]) -> tuple[TradeoffPoint, ...]:
    """Return the Pareto front, sorted by time: the points that no other point beats.

    A point beats another if it is better in time or error, not worse in the other quantity, and has no larger share of
    wrongly decided pixels. Controls, points with more than `MOST_WRONG` of the pixels decided wrongly, and points
    without an error are never on the front.
    """

    def beats(first: TradeoffPoint, second: TradeoffPoint) -> bool:
        if first.wrong > second.wrong:
            return False
        faster = first.nanoseconds < second.nanoseconds and first.error <= second.error * GAIN
        nearer = first.nanoseconds <= second.nanoseconds and first.error * GAIN < second.error
        return faster or nearer

    measured = [
        point
        for point in points
        if math.isfinite(point.error) and point.kind != "control" and point.wrong <= MOST_WRONG
    ]
    ahead = [point for point in measured if not any(beats(rival, point) for rival in measured)]
    return tuple(sorted(ahead, key=lambda point: (point.nanoseconds, point.label)))


def without_error(point: dict[str, Any]) -> str:
    """Return the reason why a point has no error, with its share of wrong pixels; an empty string if it has one."""
    if math.isfinite(point["error"]):
        return ""
    return "all wrong" if point["wrong"] >= 1 else f"no error, {100 * point['wrong']:.2g} % wrong"


class DiagramRecord(TypedDict):
    """A work-precision diagram: its points, and the labels of the points on its Pareto front."""

    name: str
    kind: str
    svg: str  # file name
    time_axis: str
    error_axis: str
    front: list[str]
    points: list[dict[str, Any]]  # as `point_record` returns them


class TradeoffRecord(TypedDict):
    """The content of tradeoff.json."""

    schema: int
    environment: dict[str, str]
    origin: Origin
    repetitions: int
    seconds: float
    diagrams: list[DiagramRecord]


def point_record(point: TradeoffPoint, *, on_front: bool) -> dict[str, Any]:
    """Return a point as docs/compare.md describes it; the bounds are 95 % intervals."""
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


# Run times of other renderers, and the interleaving of all launches.


Launch = Callable[[], float]  # runs once and returns its seconds


def kernel_seconds(run: Callable[[], object]) -> float:
    """Return the run time [s] of the kernels that `run` launches through Dr.Jit, also of another renderer's kernels."""
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
    """Return the wall-clock time of `run` [s]."""
    start = time.perf_counter()
    run()
    return time.perf_counter() - start


def interleave(launches: Sequence[Launch], *, repetitions: int, budget: float) -> list[np.ndarray]:
    """Return the seconds of each launch in warm repetitions; every repetition visits all launches in a new order.

    A launch that would take more than `budget` [s] of wall-clock time in all is repeated less often: an odd number of
    times, and at least `FEWEST` times.

    Raises:
        ValueError: `repetitions` is less than `FEWEST`.

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
    return [np.array(times) for times in seconds]


# A point with its error and without its time.


@dataclass(frozen=True, kw_only=True)
class UntimedPoint:
    """A point whose nanoseconds are NaN, and the launch that times it."""

    point: TradeoffPoint
    launch: Launch
    rays: int  # per launch; pixels if samples per pixel are compared

    def timed(self, seconds: np.ndarray) -> TradeoffPoint:
        """Return the point with its time per ray, from the seconds of an odd number of launches."""
        per_ray = seconds / self.rays * 1e9
        interval = median_interval(per_ray.tolist(), level=LEVEL)
        return replace(self.point, nanoseconds=float(np.median(per_ray)), nanoseconds_interval=interval)


# Tails of errors with their intervals: the quantity on a diagram's vertical axis.


TAIL = 0.99  # quantile over pixels; the maximum cannot be estimated from a sample
TILE = 32  # number of neighbouring pixels that are resampled together
REPLICATES = 200
# The least error on the logarithmic axis, which has no 0; float64's roundoff is 2^-29 of float32's.
LEAST = 2.0**-40
SEED = 5


def tail(scenes: Sequence[np.ndarray]) -> tuple[float, Interval]:
    """Return the 99 % quantile of the scenes' errors (NaN left out) and its bootstrap interval, tiles resampled."""
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
    """Return the 99 % quantile of the scenes' finite errors, NaN if there are none."""
    values = np.concatenate([scene[np.isfinite(scene)] for scene in scenes])
    return float(np.quantile(values, TAIL)) if len(values) else float("nan")


def root_mean_square(image: np.ndarray, truth: np.ndarray) -> tuple[float, Interval]:
    """Return the RMSE of an image (height, width, channels) over the truth's mean, and its interval.

    The bootstrap resamples rows of pixels.
    """
    squares = ((image - truth) ** 2).mean(axis=(1, 2))
    scale = float(np.abs(truth).mean()) or 1.0
    drawn = np.random.default_rng(SEED).integers(len(squares), size=(REPLICATES, len(squares)))
    low, high = percentile_interval(np.sqrt(squares[drawn].mean(axis=1)), level=LEVEL)
    at = float(np.sqrt(squares.mean()))
    return max(at / scale, LEAST), (max(low / scale, LEAST), max(high / scale, LEAST))
