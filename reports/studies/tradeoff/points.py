"""A point of a work-precision diagram, and which points nothing else beats in both directions."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypedDict

from rayproof.reports.studies.compare.statistics import Interval

GAIN = 1.01  # an error that is less than a hundredth smaller buys no place on the front


@dataclass(frozen=True, kw_only=True)
class Point:
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


def front(points: Sequence[Point]) -> tuple[Point, ...]:
    """Return the Pareto front by time: points that no other beats in one of time and error without losing the other.

    A point that decides more pixels wrongly beats none. Controls, known to be wrong somewhere, and points without an
    error are not on it.
    """

    def beats(one: Point, other: Point) -> bool:
        if one.wrong > other.wrong:
            return False
        faster = one.nanoseconds < other.nanoseconds and one.error <= other.error * GAIN
        nearer = one.nanoseconds <= other.nanoseconds and one.error * GAIN < other.error
        return faster or nearer

    measured = [one for one in points if math.isfinite(one.error) and one.kind != "control"]
    ahead = [one for one in measured if not any(beats(other, one) for other in measured)]
    return tuple(sorted(ahead, key=lambda one: (one.nanoseconds, one.label)))


class PointRecord(TypedDict):
    """A point as docs/tradeoff.md describes it; bounds are those of 95 % intervals."""

    diagram: str
    label: str
    renderer: str
    variant: str
    precision: str
    samples: int  # per pixel
    kind: str
    nanoseconds: float  # per ray or pixel, as the diagram's axis says
    nanoseconds_low: float
    nanoseconds_high: float
    clock: str
    error: float  # what the diagram's axis says
    error_low: float
    error_high: float
    natural: float | None
    unit: str
    wrong: float  # share of pixels
    front: bool


class DiagramRecord(TypedDict):
    """A work-precision diagram: which points it has, and the labels of those on its Pareto front."""

    name: str
    kind: str
    svg: str  # file name
    time_axis: str
    error_axis: str
    front: list[str]
    points: list[PointRecord]


class TradeoffRecord(TypedDict):
    """What tradeoff.json holds."""

    schema: int
    environment: dict[str, str]
    repetitions: int
    seconds: float
    diagrams: list[DiagramRecord]


def point_record(point: Point, *, on_front: bool) -> PointRecord:
    """Return a point as plain data; see docs/tradeoff.md."""
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
