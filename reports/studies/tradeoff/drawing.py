"""A diagram as static SVG: time against error, log-log, intervals as crosses, the Pareto front as a line.

The same numbers give the same bytes: no date, and ids from a fixed salt.
"""

import io
import math
from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

from rayproof.reports.studies.tradeoff.points import DiagramRecord, PointRecord

MARKERS = {"float32": "o", "float64": "s"}
SETTINGS: dict[Any, Any] = {
    "svg.hashsalt": "rayproof",
    "svg.fonttype": "none",
    "font.size": 8,
    "axes.grid": True,
    "grid.alpha": 0.3,
}
COLORS = ("#4477aa", "#ee6677", "#228833", "#ccbb44", "#66ccee", "#aa3377", "#777777", "#994455", "#004488", "#997700")


def svg(diagram: DiagramRecord) -> str:
    """Return a diagram's SVG text."""
    with mpl.rc_context(SETTINGS):
        file = io.StringIO()
        draw(diagram).savefig(file, format="svg", metadata={"Date": None, "Creator": "rayproof"})
    return file.getvalue()


def draw(diagram: DiagramRecord) -> Figure:
    """Return the diagram as a figure."""
    figure = Figure(figsize=(8.0, 5.0))
    # Room for the legend; working the layout out would cost a second a diagram.
    figure.subplots_adjust(left=0.1, right=0.68, top=0.94, bottom=0.1)
    axes = figure.add_subplot()
    names = list(dict.fromkeys(_hue(point) for point in diagram["points"]))
    for point in diagram["points"]:
        _mark(axes, point, COLORS[names.index(_hue(point)) % len(COLORS)])
    ahead = [point for name in diagram["front"] for point in diagram["points"] if point["label"] == name]
    axes.plot(
        [point["nanoseconds"] for point in ahead],
        [point["error"] for point in ahead],
        color="black",
        linewidth=0.8,
        linestyle="--",
        zorder=1,
        label="Pareto front",
    )
    axes.set_xscale("log")
    # Where nothing has an error, as on a ladder that only counts wrong answers, nothing is logarithmic.
    axes.set_yscale("log" if any(math.isfinite(point["error"]) for point in diagram["points"]) else "linear")
    # Powers of ten alone would leave an axis of less than a decade without a number.
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.set_xlabel(diagram["time_axis"])
    axes.set_ylabel(diagram["error_axis"])
    axes.set_title(f"{diagram['name']}: faster to the left, more accurate below")
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=6, frameon=False)
    return figure


def _hue(point: PointRecord) -> str:
    return point["variant"] or point["renderer"]


def _mark(axes: Any, point: PointRecord, color: str) -> None:
    """Draw a point with its intervals; filled on the front, its label with the wrong share if there is one."""
    if not math.isfinite(point["error"]):
        return  # nothing was decided rightly, so nothing has an error
    x, y = point["nanoseconds"], point["error"]
    wrong = f" ({100 * point['wrong']:.2g} % wrong)" if point["wrong"] else ""
    axes.errorbar(
        [x],
        [y],
        xerr=[[x - point["nanoseconds_low"]], [point["nanoseconds_high"] - x]],
        yerr=[[y - point["error_low"]], [point["error_high"] - y]],
        fmt="^" if point["kind"] == "reference" else "x" if point["kind"] == "control" else MARKERS[point["precision"]],
        color=color,
        markerfacecolor=color if point["front"] else "white",
        markersize=5,
        elinewidth=0.8,
        label=f"{point['label']}{wrong}",
        zorder=2,
    )
