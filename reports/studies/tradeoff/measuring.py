"""All diagrams measured: errors first, then every launch of every diagram interleaved with all others."""

import time
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from rayproof.cases.ladders import Ladder
from rayproof.reports.studies.tradeoff.clocks import interleave
from rayproof.reports.studies.tradeoff.formulas import Task, entries
from rayproof.reports.studies.tradeoff.ladders import LADDER, ladder_entries
from rayproof.reports.studies.tradeoff.points import DiagramRecord, Point, TradeoffRecord, front, point_record
from rayproof.reports.studies.tradeoff.routes import ROUTES, route_entries
from rayproof.reports.studies.tradeoff.sampling import sampling_entries
from rayproof.reports.studies.tradeoff.tasks import Sampled
from rayproof.tracer.formulas import Formula
from rayproof.tracer.kernel.arrays import versions

SAMPLES = "samples"
KINDS = {SAMPLES: "samples", ROUTES: "paths", LADDER: "ladders"}  # the first half of a diagram's name; others are slots
BUDGET = 0.6  # s of launches per point
AXES = {
    "formulas": ("ns per ray", "p99 of |dt| / (K u32)"),
    "ladders": ("ns per ray", "p99 of error / (K u32)"),
    "samples": ("ns per pixel", "RMSE of radiance over its mean"),
    "paths": ("ns per pixel", "p99 of |dL| / (full light u32)"),
}


def overall(points: Sequence[Point], group: str) -> list[Point]:
    """Return one point a label: geometric means over the group's diagrams, of those that answer in all of them."""
    mine = [point for point in points if point.diagram.split("/")[0] == group]
    diagrams = {point.diagram for point in mine}
    found = []
    for label in dict.fromkeys(point.label for point in mine):
        same = [point for point in mine if point.label == label]
        if len(same) < len(diagrams) or not all(np.isfinite(point.error) for point in same):
            continue
        found.append(
            replace(
                same[0],
                diagram=f"{group}/overall",
                nanoseconds=_mean([point.nanoseconds for point in same]),
                nanoseconds_interval=_means([point.nanoseconds_interval for point in same]),
                error=_mean([point.error for point in same]),
                error_interval=_means([point.error_interval for point in same]),
                natural=None,
                wrong=float(np.mean([point.wrong for point in same])),
            )
        )
    return found


def _mean(values: Sequence[float]) -> float:
    return float(np.exp(np.mean(np.log(values))))


def _means(intervals: Sequence[tuple[float, float]]) -> tuple[float, float]:
    """Return the interval that holds if all do: wider than the mean's own, never narrower."""
    return _mean([low for low, _ in intervals]), _mean([high for _, high in intervals])


def measure(
    formulas: Sequence[Task],
    sampled: Sequence[Sampled],
    climbed: Sequence[Ladder],
    *,
    repetitions: int,
    tell: Callable[[str], None],
    named: Sequence[Formula] = (),
) -> TradeoffRecord:
    """Return all points and diagrams as docs/tradeoff.md describes them; of ladders those of the formulas `named`."""
    start = time.monotonic()
    ready = [entry for task in formulas for entry in entries(task, tell)]
    for one in sampled:
        ready += sampling_entries(f"{SAMPLES}/{one.family}", one.scene, tell)
        ready += route_entries(f"{ROUTES}/{one.family}", one.scene, tell)
    ready += [entry for ladder in climbed for entry in ladder_entries(ladder, tell, named)]
    tell(f"run times of {len(ready)} points")
    seconds = interleave([entry.launch for entry in ready], repetitions=repetitions, budget=BUDGET)
    points = [entry.timed(times) for entry, times in zip(ready, seconds, strict=True)]
    for group in dict.fromkeys(point.diagram.split("/")[0] for point in points):
        if group != LADDER and len({point.diagram for point in points if point.diagram.split("/")[0] == group}) > 1:
            points += overall(points, group)
    return {
        "schema": 1,
        "environment": versions(),
        "repetitions": repetitions,
        "seconds": round(time.monotonic() - start, 3),
        "diagrams": [_diagram(points, name) for name in dict.fromkeys(point.diagram for point in points)],
    }


def _diagram(points: Sequence[Point], name: str) -> DiagramRecord:
    mine = [point for point in points if point.diagram == name]
    ahead = front(mine)
    kind = KINDS.get(name.split("/")[0], "formulas")
    time_axis, error_axis = AXES[kind]
    return {
        "name": name,
        "kind": kind,
        "svg": f"{name.replace('/', '-')}.svg",
        "time_axis": time_axis,
        "error_axis": error_axis,
        "front": [point.label for point in ahead],
        "points": [point_record(point, on_front=point in ahead) for point in mine],
    }
