"""Figures of ladders as SVG: every formula's error, or share of wrong answers, against the parameter.

The files have no date and no random identifiers, and text stays text: the same numbers make the same file.
"""

import csv
import math
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import matplotlib as mpl
import msgspec
import numpy as np
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.ticker import AutoLocator, NullLocator, StrMethodFormatter

from rayproof.cases.ladders import Ladder
from rayproof.reports.results.files import as_json
from rayproof.reports.studies.publication import Draw
from rayproof.reports.studies.stability.records import ClimbRecord, Rung
from rayproof.reports.studies.stability.survey import about

MARKERS = "os^vD<>ph*Xd"
STYLE: dict[Any, Any] = {"svg.hashsalt": "rayproof", "svg.fonttype": "none", "font.size": 8.0}
SMALLEST_SHARE = 1e-6  # a share of zero is drawn at this height
# Inches. Fixed numbers, because an automatic layout draws every figure twice and measures each of its texts.
HEIGHT, PANEL, LEFT, GAP, BELOW, ABOVE = 3.6, 4.0, 0.75, 0.6, 0.5, 0.5
KEY, CHARACTER = 0.5, 0.068  # widths in the legend: of a line sample, and of a letter


def figure(file: Path, ladder: Ladder, records: Sequence[ClimbRecord]) -> None:
    """Write the figure of one ladder, a panel per precision."""
    precisions = sorted({record.precision for record in records})
    # A formula must have the same colour in all panels.
    formulas = list(dict.fromkeys(record.formula for record in records))
    with mpl.rc_context(STYLE):
        width = LEFT + len(precisions) * (PANEL + GAP) - GAP
        total = width + KEY + CHARACTER * max((len(_label(record)) for record in records), default=0)
        drawing = Figure(figsize=(total, HEIGHT))
        FigureCanvasSVG(drawing)
        drawing.subplots_adjust(
            left=LEFT / total, right=width / total, bottom=BELOW / HEIGHT, top=1 - ABOVE / HEIGHT, wspace=GAP / PANEL
        )
        panels = drawing.subplots(1, len(precisions), squeeze=False)[0]
        for panel, precision in zip(panels, precisions, strict=True):
            _panel(panel, ladder, records, precision, formulas)
            panel.set_title(precision)
            panel.grid(visible=True, linewidth=0.3)
        panels[0].set_ylabel(_height_axis(ladder))
        panels[-1].legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False)
        drawing.suptitle(ladder.name)
        drawing.savefig(file, format="svg", metadata={"Date": None, "Creator": None})


def _height_axis(ladder: Ladder) -> str:
    return f"median error [{ladder.unit}]" if _measures(ladder) else "share of wrong answers"


def _panel(panel: Any, ladder: Ladder, records: Sequence[ClimbRecord], precision: str, formulas: Sequence[str]) -> None:
    """Draw the records of one precision; the index in `formulas`, all formulas of the figure, gives the colour."""
    for record in records:
        if record.precision == precision:
            _line(panel, ladder, record, formulas.index(record.formula))
    panel.set(xlabel=ladder.parameter, xscale="symlog" if 0.0 in ladder.values else "log")
    # Without any error, if all answers are exact, a logarithmic axis has no limits.
    panel.set_yscale("log" if panel.lines and any(line.get_ydata().size for line in panel.lines) else "linear")
    if ladder.values[0] > ladder.values[-1]:
        panel.invert_xaxis()
    for axis in (panel.xaxis, panel.yaxis):
        # Powers in mathematical type and nine minor ticks per decade would take most of the drawing time.
        axis.set_major_formatter(StrMethodFormatter("{x:g}"))
        axis.set_minor_locator(NullLocator())
    heights = [height for line in panel.lines for height in line.get_ydata()]
    if heights and max(heights) < 10 * min(heights):
        # With only powers of ten the axis would have no number.
        panel.yaxis.set_major_locator(AutoLocator())


def most_different(ladders: Sequence[Ladder], records: Sequence[ClimbRecord], most: int) -> list[Ladder]:
    """Return at most `most` ladders, in their order: those where the formulas' lines are farthest apart."""

    def apart(ladder: Ladder) -> float:
        """Return the mean over precisions and values of the decades between the lowest and the highest line."""
        heights: dict[tuple[str, float], list[float]] = {}
        for climb in (record for record in records if record.ladder == ladder.name):
            for rung in climb.values:
                height = _height(ladder, rung)
                if height is not None and height > 0:
                    heights.setdefault((climb.precision, rung.value), []).append(height)
        spans = [math.log10(max(line_heights) / min(line_heights)) for line_heights in heights.values()]
        return sum(spans) / len(spans) if spans else 0.0

    farthest = sorted(ladders, key=apart, reverse=True)[:most]
    return [ladder for ladder in ladders if ladder in farthest]


def paper_rows(
    ladders: Sequence[Ladder], records: Sequence[ClimbRecord], sweep: tuple[str, dict[str, float]] | None
) -> list[list[Draw]]:
    """Return a row of panels for each ladder, one panel per precision; a formula has the same colour in all of them.

    For a `sweep`, a parameter's name and the value of each formula, return a single row: the largest error and the
    share of wrong answers over the parameter.
    """
    precisions = sorted({row.precision for row in records})
    formulas = list(dict.fromkeys(row.formula for row in records))

    def climbed(ladder: Ladder, precision: str, panel: Any) -> None:
        ladder_records = [row for row in records if row.ladder == ladder.name]
        _panel(panel, ladder, ladder_records, precision, formulas)
        panel.set(title=f"{ladder.name}, {precision}", ylabel=_height_axis(ladder))

    if sweep is None:
        return [[partial(climbed, ladder, precision) for precision in precisions] for ladder in ladders]
    name, values = sweep

    def swept(height: Callable[[ClimbRecord], float | None], label: str, panel: Any) -> None:
        for number, ladder in enumerate(ladders):
            for precision, style in zip(precisions, ("-", "--"), strict=False):
                ladder_records = [row for row in records if (row.ladder, row.precision) == (ladder.name, precision)]
                points = [(values[row.formula], height(row)) for row in ladder_records if row.formula in values]
                kept = [(x, y) for x, y in points if y is not None and y > 0]
                panel.plot(
                    np.array([x for x, _ in kept]), np.array([y for _, y in kept]), style, marker="o",
                    color=f"C{number % 10}", label=f"{ladder.name}, {precision}",
                )  # fmt: skip
        panel.set(xscale="log", xlabel=name, ylabel=label)
        panel.set_yscale("log" if any(line.get_ydata().size for line in panel.lines) else "linear")

    def wrong(row: ClimbRecord) -> float:
        return (row.false_hits + row.false_misses + row.invalid) / max(1, row.rays)

    error = partial(swept, lambda row: row.scaled_error, "largest error / (K u)")
    return [[error, partial(swept, wrong, "share of wrong answers")]]


def _measures(ladder: Ladder) -> bool:
    return ladder.kind == "sweep"


def _line(panel: Any, ladder: Ladder, climb: ClimbRecord, index: int) -> None:
    points = [(rung.value, _height(ladder, rung)) for rung in climb.values]
    kept = [(value, height) for value, height in points if height is not None and height > 0]
    style = "--" if climb.expected == "fail" else "-"
    panel.plot(
        np.array([value for value, _ in kept]),
        np.array([height for _, height in kept]),
        style,
        marker=MARKERS[index % len(MARKERS)],
        color=f"C{index % 10}",
        markersize=3,
        linewidth=0.8,
        label=_label(climb),
    )


def _label(climb: ClimbRecord) -> str:
    return climb.formula + (" (expected to fail)" if climb.expected == "fail" else "")


def _height(ladder: Ladder, rung: Rung) -> float | None:
    if _measures(ladder):
        return rung.median
    wrong = rung.false_hits + rung.false_misses + rung.invalid
    return max(wrong / rung.rays, SMALLEST_SHARE) if rung.rays else None


# Ladders as files: JSON, CSV and SVG; the same numbers give the same bytes.


def publish(folder: Path, ladder: Ladder, records: Sequence[ClimbRecord]) -> None:
    """Write NAME.json, NAME.csv and NAME.svg of one ladder to `folder`, which must exist."""
    content = as_json({**about(ladder), "climbs": records}, indent=2)
    (folder / f"{ladder.name}.json").write_text(content + "\n", encoding="utf-8")
    rows = [
        {"formula": record.formula, "precision": record.precision} | msgspec.to_builtins(rung)
        for record in records
        for rung in record.values
    ]
    columns = list(dict.fromkeys(name for row in rows for name in row))
    with (folder / f"{ladder.name}.csv").open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, columns, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    figure(folder / f"{ladder.name}.svg", ladder, records)
