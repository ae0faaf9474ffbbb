"""index.html: the report to open from disk. Totals and coverage inline; each case's pixels in a script of its own.

Browsers refuse fetch() and module scripts on file://, so the page's scripts are inlined in order and a case's data is
a script that the page adds when the case is opened. The content-security policy names the inlined script and style by
hash: no request leaves the folder, and markup smuggled in by a scene's name could not run even if it got through.
"""

import base64
import hashlib
import html
import os
from collections.abc import Mapping
from concurrent.futures import ProcessPoolExecutor
from importlib.resources import files
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from reports.publish import PUBLISHERS
from reports.publish.atomic import write_text
from reports.publish.audit import front, load_audit
from reports.publish.case_data import write_case_data
from reports.publish.front_data import case_row, front_data
from reports.publish.headline import headline, shouts, worst_first
from reports.publish.panel_data import findings, panel
from reports.publish.pixels import inert
from reports.publish.plots import pages
from reports.publish.results import plain
from reports.publish.tradeoff import diagrams

# In the order in which they build on each other.
SCRIPTS = (
    "elements", "numbers", "verdicts", "address", "settings", "predict", "decode", "load", "colors", "paint", "ssim",
    "errors", "edges", "histogram", "transform", "keys", "command", "navigation", "front", "plot", "ladders",
    "stability", "tradeoff", "audit", "references", "coverage",
    "filtering", "virtual", "cases", "pane", "pointing", "viewer", "colorbar", "toolbar", "stage_view", "inspector",
    "checks", "adjudication", "scene", "case", "start",
)  # fmt: skip

STYLES = ("style", "cases", "viewer", "scene", "pages")

FEW = 16  # cases that one process writes sooner than another one starts

_PAGE = """<!doctype html><!--{shout}-->
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{policy}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<meta name="referrer" content="no-referrer">
<link rel="icon" href="data:,">
<title>{title}</title>
<style>{style}</style>
</head>
<body>
<noscript><p>{shout}</p><p>{headline}</p><p>The report needs JavaScript; summary.md has the totals.</p></noscript>
<div id="app"></div>
<script type="application/json" id="results">{data}</script>
{inlined}<script>{script}</script>
</body>
</html>
"""


@PUBLISHERS.register("html")
def publish(folder: Path, results: dict[str, Any]) -> list[Path]:
    """Write index.html and data/*.js."""
    ordered = list(enumerate(worst_first(results["cases"]), start=1))
    written = _write_all(folder, ordered)
    # Data of an earlier publication of the same folder, when it had more cases.
    for stale in set((folder / "data").glob("*.js")) - set(written):
        stale.unlink()
    return [write_text(folder / "index.html", page_text(folder, results)), *written]


def page_text(folder: Path, results: dict[str, Any], inlined: Mapping[str, str] | None = None) -> str:
    """Return index.html. `inlined` maps paths below `folder` to JSON that the page then does not ask the disk for."""
    rows = [case_row(folder, data_file(i), case) for i, case in enumerate(worst_first(results["cases"]), start=1)]
    data = front_data(results, rows) | {
        "audit": front(load_audit(folder)),
        "tradeoff": diagrams(folder),
        "plots": pages(folder),
        "panel": panel(results["cases"]),
        "findings": findings(results),
    }
    style = "\n".join(_asset(f"{name}.css") for name in STYLES)
    script = "\n".join(_asset(f"{name}.js") for name in SCRIPTS)
    loud = " ".join(shouts(results))
    return _PAGE.format(
        shout=html.escape(loud).replace("--", "&#45;&#45;"),
        policy=html.escape(policy(script, style)),
        title=html.escape(f"{'! ' if loud else ''}rayproof: {results.get('verdict') or 'report'}"),
        headline=html.escape(headline(results)),
        style=style,
        data=script_safe(data),
        inlined="".join(
            f'<script type="application/json" data-path="{html.escape(path)}">{content}</script>\n'
            for path, content in (inlined or {}).items()
        ),
        script=script,
    )


def data_file(number: int) -> str:
    """Return where the record of the case at a place of the list is, from 1, below the results folder."""
    return f"data/{number:04}.js"


def _write_all(folder: Path, ordered: list[tuple[int, dict[str, Any]]]) -> list[Path]:
    """Write every case's data, on every processor where there are many: compressing images is what takes the time."""
    jobs = [(folder, folder / data_file(number), case) for number, case in ordered]
    heavy = sum(1 for *_, case in jobs if not case.get("pixels"))
    workers = min(os.cpu_count() or 1, heavy // FEW)
    if workers < 2:
        written = [write_case_data(*job) for job in jobs]
    else:
        with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
            written = list(pool.map(write_case_data, *zip(*jobs, strict=True), chunksize=4))
    return [path for paths in written for path in paths]


def policy(script: str, style: str) -> str:
    """Return a content-security policy that lets nothing in but this folder and these two texts.

    Plotly makes an empty style sheet and fills it rule by rule, which needs the hash of nothing at all.
    """
    return (
        f"default-src 'none'; script-src 'self' file: '{_digest(script)}'; "
        f"style-src '{_digest(style)}' '{_digest('')}'; "
        "img-src 'self' file: data: blob:; frame-src 'self' file:; base-uri 'none'; form-action 'none'"
    )


def script_safe(data: Any) -> str:
    """Return JSON that can stand inside a script element whatever strings it holds."""
    return inert(plain(data))


def _digest(text: str) -> str:
    return "sha256-" + base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()


def _asset(name: str) -> str:
    return files("reports.publish").joinpath("html", name).read_text(encoding="utf-8")
