"""Overall diagrams: what a choice costs and errs over all families, each family with one vote."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rayproof.reports.studies.tradeoff.points import Point


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
