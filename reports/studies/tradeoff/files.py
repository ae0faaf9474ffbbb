"""What is written: tradeoff.json, tradeoff.csv, one SVG a diagram, and a page that shows them without any script."""

import base64
import csv
import hashlib
import html
import io
import json
from pathlib import Path

from rayproof.reports.results.atomic import write_text
from rayproof.reports.results.json_numbers import plain
from rayproof.reports.studies.tradeoff.drawing import svg
from rayproof.reports.studies.tradeoff.points import DiagramRecord, PointRecord, TradeoffRecord

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
    # Diagrams of an earlier call, when it had others.
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
    """Return the page; it needs no script and lets in nothing but pictures of its own folder."""
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
        + "".join(f"<td>{html.escape(cell)}</td>" for cell in _cells(point))
        + "</tr>"
        for point in sorted(diagram["points"], key=lambda point: point["nanoseconds"])
    )
    return (
        f'<section><h2>{name}</h2><img src="{picture}" alt="{name}: {html.escape(diagram["error_axis"])} over '
        f'{html.escape(diagram["time_axis"])}"><details><summary>Numbers</summary><table><tr>'
        + "".join(f"<th>{html.escape(head)}</th>" for head in heads)
        + f"</tr>\n{rows}\n</table></details></section>"
    )


def _cells(point: PointRecord) -> tuple[str, ...]:
    return (
        point["label"],
        f"{point['nanoseconds']:.3g}",
        f"[{point['nanoseconds_low']:.3g}, {point['nanoseconds_high']:.3g}]",
        f"{point['error']:.3g}",
        f"[{point['error_low']:.3g}, {point['error_high']:.3g}]",
        f"{100 * point['wrong']:.3g} %",
    )
