"""index.html: the report to open from disk. Totals and coverage inline; each case's pixels in a script of its own.

Browsers refuse fetch() and module scripts on file://, so the page's scripts are inlined in order and a case's data is
a script that the page adds when the case is opened. The content-security policy names the inlined script and style by
hash: no request leaves the folder, and markup smuggled in by a scene's name could not run even if it got through.
"""

import base64
import hashlib
import html
import os
from concurrent.futures import ProcessPoolExecutor
from importlib.resources import files
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from cases.stages import FACTS, Stage
from reports.publish import PUBLISHERS
from reports.publish.atomic import write_text
from reports.publish.audit import front, load_audit
from reports.publish.case_data import picture_of, write_case_data
from reports.publish.headline import blame, headline, shouts, worst_first, worst_ratio
from reports.publish.items import TITLES
from reports.publish.pixels import inert
from reports.publish.results import LEDGER, plain
from reports.publish.tradeoff import diagrams

# In the order in which they build on each other.
SCRIPTS = (
    "elements", "numbers", "verdicts", "address", "predict", "decode", "load", "colors", "paint",
    "difference", "front", "audit", "coverage", "cases", "inspector", "figures", "checks", "scene",
    "case", "start",
)  # fmt: skip

STYLES = ("style", "scene")

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
<script>{script}</script>
</body>
</html>
"""


@PUBLISHERS.register("html")
def publish(folder: Path, results: dict[str, Any]) -> list[Path]:
    """Write index.html and data/*.js."""
    ordered = list(enumerate(worst_first(results["cases"]), start=1))
    written = _write_all(folder, ordered)
    cases = [_row(folder, number, case) for number, case in ordered]
    # Data of an earlier publication of the same folder, when it had more cases.
    for stale in set((folder / "data").glob("*.js")) - set(written):
        stale.unlink()
    style = "\n".join(_asset(f"{name}.css") for name in STYLES)
    script = "\n".join(_asset(f"{name}.js") for name in SCRIPTS)
    loud = " ".join(shouts(results))
    page = _PAGE.format(
        shout=html.escape(loud).replace("--", "&#45;&#45;"),
        policy=html.escape(policy(script, style)),
        title=html.escape(f"{'! ' if loud else ''}rayproof: {results.get('verdict') or 'report'}"),
        headline=html.escape(headline(results)),
        style=style,
        data=script_safe(_front(results, cases) | {"audit": front(load_audit(folder)), "tradeoff": diagrams(folder)}),
        script=script,
    )
    return [write_text(folder / "index.html", page), *written]


def _write_all(folder: Path, ordered: list[tuple[int, dict[str, Any]]]) -> list[Path]:
    """Write every case's data, on every processor where there are many: compressing images is what takes the time."""
    jobs = [(folder, folder / "data" / f"{number:04}.js", case) for number, case in ordered]
    heavy = sum(1 for *_, case in jobs if not case.get("pixels"))
    workers = min(os.cpu_count() or 1, heavy // FEW)
    if workers < 2:
        written = [write_case_data(*job) for job in jobs]
    else:
        with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
            written = list(pool.map(write_case_data, *zip(*jobs, strict=True), chunksize=4))
    return [path for paths in written for path in paths]


def policy(script: str, style: str) -> str:
    """Return a content-security policy that lets nothing in but this folder and these two texts."""
    return (
        f"default-src 'none'; script-src 'self' file: '{_digest(script)}'; style-src '{_digest(style)}'; "
        "img-src 'self' file: data: blob:; frame-src 'self' file:; base-uri 'none'; form-action 'none'"
    )


def script_safe(data: Any) -> str:
    """Return JSON that can stand inside a script element whatever strings it holds."""
    return inert(plain(data))


def _digest(text: str) -> str:
    return "sha256-" + base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()


def _asset(name: str) -> str:
    return files("reports.publish").joinpath("html", name).read_text(encoding="utf-8")


def _front(results: dict[str, Any], cases: list[dict[str, Any]]) -> dict[str, Any]:
    keys = ("rayproof", "command", "started", "seconds", "verdict", "environment", "configurations", "references")
    details = results.get("coverage_detail", {})
    return {
        **{key: results.get(key) for key in keys},
        "summary": results["summary"],
        "checks": results["checks"],
        "ledger": LEDGER,
        "shouts": shouts(results),
        "headline": headline(results),
        "coverage": [
            {"id": item, "what": TITLES.get(item, ""), "cases": count, **details.get(item, {})}
            for item, count in results["coverage"].items()
        ],
        "review": results.get("review", []),
        "stages": [
            {"name": stage.value, "unit": FACTS[stage].unit, "meaning": FACTS[stage].meaning} for stage in Stage
        ],
        "cases": cases,
    }


def _row(folder: Path, number: int, case: dict[str, Any]) -> dict[str, Any]:
    """Return what the list of cases shows and searches of one case."""
    keys = ("name", "family", "verdict", "stage", "item", "reason", "stresses", "covers", "seconds", "reproduce")
    cells: dict[str, dict[str, int]] = {}
    for check in case.get("checks", []):
        counts = cells.setdefault(str(check.get("reference")), {})
        counts[check["verdict"]] = counts.get(check["verdict"], 0) + 1
    for entry in case.get("unsupported", []):
        counts = cells.setdefault(str(entry.get("reference")), {})
        counts["unsupported"] = counts.get("unsupported", 0) + 1
    return {
        **{key: case.get(key) for key in keys},
        "file": f"data/{number:04}.js",
        "blame": blame(case),
        "ratio": worst_ratio(case),
        "cells": cells,
        "stages": sorted({str(check["stage"]) for check in case.get("checks", []) if check.get("stage")}),
        "picture": picture_of(folder, case),
    }
