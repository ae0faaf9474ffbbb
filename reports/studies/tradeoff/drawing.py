"""Work-precision diagrams as SVG, tables and a page.

The same numbers give the same bytes: the files have no date, and ids are made from a fixed salt.
"""

import base64
import csv
import hashlib
import html
import io
import json
import math
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

from rayproof.reports.results.files import plain, write_text
from rayproof.reports.studies.publication import COLORS, Draw
from rayproof.reports.studies.tradeoff.points import DiagramRecord, TradeoffRecord, without_error

MARKERS = {"float32": "o", "float64": "s"}
SETTINGS: dict[Any, Any] = {
    "svg.hashsalt": "rayproof",
    "svg.fonttype": "none",
    "font.size": 8,
    "axes.grid": True,
    "grid.alpha": 0.3,
}


def svg(diagram: DiagramRecord) -> str:
    """Return a diagram's SVG text."""
    with mpl.rc_context(SETTINGS):
        file = io.StringIO()
        draw(diagram).savefig(file, format="svg", metadata={"Date": None, "Creator": "rayproof"})
    return file.getvalue()


def draw(diagram: DiagramRecord) -> Figure:
    """Return the diagram as a figure."""
    figure = Figure(figsize=(8.0, 5.0))
    # Leave room for the legend; an automatic layout would take a second per diagram.
    figure.subplots_adjust(left=0.1, right=0.68, top=0.94, bottom=0.1)
    axes = figure.add_subplot()
    panel(axes, diagram, hues([diagram]))
    axes.set_title(f"{diagram['name']}: faster to the left, more accurate below")
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=6, frameon=False)
    return figure


def hues(diagrams: Sequence[DiagramRecord]) -> list[str]:
    """Return the variants and renderers that get a colour of their own in these diagrams."""
    return list(dict.fromkeys(_hue(point) for diagram in diagrams for point in diagram["points"]))


def paper_rows(diagrams: Sequence[DiagramRecord]) -> list[list[Draw]]:
    """Return a row of panels for each diagram, the same formula in the same colour in all of them."""
    names = hues(diagrams)

    def drawn(diagram: DiagramRecord, axes: Any) -> None:
        panel(axes, diagram, names, shares=False)
        axes.set_title(diagram["name"])

    return [[partial(drawn, diagram)] for diagram in diagrams]


def panel(axes: Any, diagram: DiagramRecord, names: Sequence[str], *, shares: bool = True) -> None:
    """Draw a diagram's points and its Pareto front; labels have the shares of wrong pixels if `shares`."""
    for point in diagram["points"]:
        _mark(axes, point, COLORS[names.index(_hue(point)) % len(COLORS)], shares=shares)
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
    # Without any error, as on a ladder that only counts wrong answers, a logarithmic axis has no limits.
    axes.set_yscale("log" if any(math.isfinite(point["error"]) for point in diagram["points"]) else "linear")
    # With only powers of ten an axis of less than a decade would have no number.
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.set_xlabel(diagram["time_axis"])
    axes.set_ylabel(diagram["error_axis"])


def _hue(point: dict[str, Any]) -> str:
    return point["variant"] or point["renderer"]


def _mark(axes: Any, point: dict[str, Any], color: str, *, shares: bool) -> None:
    """Draw a point with its intervals, filled if it is on the front; its label has the share of wrong pixels if any."""
    if why := without_error(point):
        # A formula that decides no pixel rightly has no error; draw it at the upper edge, above every error.
        axes.plot(
            [point["nanoseconds"]], [1.0], marker="v", linestyle="", color=color, markerfacecolor=color, markersize=6,
            transform=axes.get_xaxis_transform(), clip_on=False, label=f"{point['label']} ({why})", zorder=3,
        )  # fmt: skip
        return
    x, y = point["nanoseconds"], point["error"]
    wrong = f" ({100 * point['wrong']:.2g} % wrong)" if point["wrong"] and shares else ""
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


# Output files: tradeoff.json, tradeoff.csv, one SVG per diagram, and a page that shows them without scripts.


FOLDER = "tradeoff"
STYLE = (
    "body{font:15px/1.5 system-ui,sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem;color-scheme:light dark}"
    "img{max-width:100%;background:#fff}table{border-collapse:collapse;font-size:13px}"
    "td,th{padding:.15rem .6rem;text-align:right}td:first-child,th:first-child{text-align:left}.front{font-weight:600}"
)
PAGE = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{policy}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="referrer" content="no-referrer">
<link rel="icon" href="data:,">
<title>rayproof: error against run time</title>
<style>{style}</style>
</head>
<body>
<h1>Error against run time</h1>
<p>{about}</p>
<p><a href="tradeoff.json">tradeoff.json</a>, <a href="tradeoff.csv">tradeoff.csv</a>{back}</p>
{sections}
</body>
</html>
"""


def write(out: Path, result: TradeoffRecord) -> list[Path]:
    """Write everything below `out`/tradeoff and return the paths."""
    folder = out / FOLDER
    written = [
        write_text(folder / "tradeoff.json", json.dumps(plain(result), indent=2, allow_nan=False) + "\n"),
        write_text(folder / "tradeoff.csv", table(result)),
    ]
    written += [write_text(folder / diagram["svg"], svg(diagram)) for diagram in result["diagrams"]]
    # Remove diagrams of an earlier call that are no longer part of the result.
    for stale in set(folder.glob("*.svg")) - set(written):
        stale.unlink()
    return [*written, write_text(folder / "index.html", page(result, report=(out / "index.html").is_file()))]


def table(result: TradeoffRecord) -> str:
    """Return all points as CSV."""
    rows = [point for diagram in result["diagrams"] for point in diagram["points"]]
    file = io.StringIO()
    if rows:
        writer = csv.DictWriter(file, fieldnames=list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    return file.getvalue()


def page(result: TradeoffRecord, *, report: bool) -> str:
    """Return the page as HTML; it has no scripts, and its policy allows only pictures of its own folder."""
    digest = base64.b64encode(hashlib.sha256(STYLE.encode()).digest()).decode()
    facts = ", ".join(f"{key} {value}" for key, value in result["environment"].items() if not key.startswith("drjit_"))
    return PAGE.format(
        policy=f"default-src 'none'; img-src 'self' file: data:; style-src 'sha256-{digest}'; base-uri 'none'; "
        "form-action 'none'",
        style=STYLE,
        about=html.escape(f"{result['repetitions']} interleaved repetitions; {facts}."),
        back=', <a href="../index.html">the report</a>' if report else "",
        sections="\n".join(map(_section, result["diagrams"])),
    )


def _section(diagram: DiagramRecord) -> str:
    name, picture = html.escape(diagram["name"]), html.escape(diagram["svg"])
    heads = ("", diagram["time_axis"], "", diagram["error_axis"], "", "wrong")
    rows = "\n".join(
        f"<tr{' class=front' if point['front'] else ''}>"
        + "".join(f"<td>{html.escape(cell)}</td>" for cell in cells(point))
        + "</tr>"
        for point in sorted(diagram["points"], key=lambda point: point["nanoseconds"])
    )
    return (
        f'<section><h2>{name}</h2><img src="{picture}" alt="{name}: {html.escape(diagram["error_axis"])} over '
        f'{html.escape(diagram["time_axis"])}"><details><summary>Numbers</summary><table><tr>'
        + "".join(f"<th>{html.escape(head)}</th>" for head in heads)
        + f"</tr>\n{rows}\n</table></details></section>"
    )


def cells(point: dict[str, Any]) -> tuple[str, ...]:
    """Return label, time, error and share of wrong pixels with their intervals."""
    return (
        point["label"],
        f"{point['nanoseconds']:.3g}",
        f"[{point['nanoseconds_low']:.3g}, {point['nanoseconds_high']:.3g}]",
        without_error(point).partition(",")[0] or f"{point['error']:.3g}",
        "" if without_error(point) else f"[{point['error_low']:.3g}, {point['error_high']:.3g}]",
        f"{100 * point['wrong']:.3g} %",
    )
